"""Entry points of the executables.

They listen to signals before they import: rclpy and the planner's libraries take seconds to load on
a busy machine, and a container may be stopped right then.
"""

from __future__ import annotations

import sys

from rbprm_ros.signals import stop_event


def planner_node() -> None:
    """The planner's node."""
    stop = stop_event()
    from rbprm_ros.planner_node import run

    sys.exit(run(stop))


def publish_surfaces() -> None:
    """The stand-in for perception."""
    stop = stop_event()
    from rbprm_ros.publish_surfaces import run

    sys.exit(run(stop, sys.argv))
