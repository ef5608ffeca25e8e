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

PERIOD = 0.1  # seconds between two checks of the end condition


def init() -> None:
    """Initialise rclpy with the process's arguments and without its signal handlers."""
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)


def node_of_argument(
    arguments: list[str], usage: str, make: Callable[[str], MadeNode]
) -> MadeNode | None:
    """A node made from the only argument of a command line.

    Args:
        arguments: the command line, with ROS's own arguments.
        usage: text that describes the command line.
        make: makes the node from the argument.

    Returns:
        The node; None, after a line on stderr, where the number of arguments is not one or the
        argument cannot be used.
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
    """Runs the callbacks of one node in one thread.

    An exception of a callback is logged and does not end the process.

    Args:
        node: the node.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(node)

    def spin_until(self, done: Callable[[], bool], timeout: float = float("inf")) -> None:
        """Run callbacks until a condition holds, the timeout passes, or rclpy is shut down.

        Args:
            done: the condition.
            timeout: longest time, seconds.
        """
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
        """Destroy the node and shut rclpy down."""
        self._executor.shutdown()
        self._node.destroy_node()
        try_shutdown()
