"""Former name of `rbprm_ros.rclpy_utils.spinning`, kept for one release."""

import warnings

from rbprm_ros.rclpy_utils.spinning import Spinner, init

__all__ = ["Spinner", "init"]

warnings.warn(
    "rbprm_ros.spinning is now rbprm_ros.rclpy_utils.spinning", DeprecationWarning, stacklevel=2
)
