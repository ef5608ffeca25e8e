"""The main loop of a node's process."""

from __future__ import annotations

import time
import traceback
from collections.abc import Callable

import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import ok, try_shutdown

PERIOD = 0.1  # seconds between looks for a signal


def init() -> None:
    """Initialise rclpy with the process's arguments; signals are the caller's."""
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)


class Spinner:
    """Serves the callbacks of one node in one thread.

    A callback that raises is logged and does not end the process.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(node)

    def spin_until(self, done: Callable[[], bool], timeout: float = float("inf")) -> None:
        """Serve until something is true, the time in seconds is over, or rclpy is shut down."""
        end = time.monotonic() + timeout
        while not done() and ok() and time.monotonic() < end:
            try:
                self._executor.spin_once(PERIOD)
            except ExternalShutdownException:
                return
            except Exception:
                if ok():
                    self._node.get_logger().error(f"in a callback: {traceback.format_exc()}")

    def close(self) -> None:
        """Take the node out of ROS."""
        self._executor.shutdown()
        self._node.destroy_node()
        try_shutdown()
