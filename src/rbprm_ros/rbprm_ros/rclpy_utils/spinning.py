"""The main loop of a node's process."""

from __future__ import annotations

import sys
import time
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import ok, remove_ros_args, try_shutdown

from rbprm_core.errors import RbprmError

MadeNode = TypeVar("MadeNode", bound=Node)

PERIOD = 0.1  # seconds between looks for a signal


def init() -> None:
    """Initialise rclpy with the process's arguments; signals are the caller's."""
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)


def node_of_argument(
    arguments: list[str], usage: str, make: Callable[[str], MadeNode]
) -> MadeNode | None:
    """A node made of the one argument of a command line.

    None where there is not one argument or it is no good, which a line on stderr then says.

    Args:
        arguments: the command line, with ROS's own arguments. usage: what it should be.
    """
    init()
    name, *own = remove_ros_args(arguments)
    if len(own) != 1:
        print(usage, file=sys.stderr)
        return None
    try:
        return make(own[0])
    except RbprmError as error:
        print(f"{Path(name).name}: {error}", file=sys.stderr)
        return None


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
        while not done() and ok() and (left := end - time.monotonic()) > 0:
            try:
                self._executor.spin_once(min(PERIOD, left))
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
