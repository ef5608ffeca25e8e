"""`record_bag FOLDER`: record a planner's surfaces, sequences, guides and status until stopped."""

from __future__ import annotations

import threading
from functools import partial
from pathlib import Path

from rclpy.node import Node

from rbprm_ros.bags.storage import TOPICS, BagMessage, BagWriter
from rbprm_ros.rclpy_utils.spinning import Spinner, node_of_argument
from rbprm_ros.rclpy_utils.subscription import EveryPublisher

USAGE = "usage: record_bag FOLDER [--ros-args -p storage:=mcap|sqlite3 -p planner:=NODE]"
DRAIN_TIME = 0.5  # seconds for messages that arrived before the signal to stop


class BagRecorder(Node):
    """Writes the messages on a planner's topics, as they are on the wire.

    Args:
        folder: folder of the bag; must not exist.

    Raises:
        InvalidInput: the folder or a parameter cannot be used.
    """

    def __init__(self, folder: Path) -> None:
        super().__init__("bag_recorder")
        storage = self.declare_parameter("storage", "mcap").value
        planner = self.declare_parameter("planner", "/rbprm_planner").value
        self._writer = BagWriter(folder, planner, storage)
        self._received: set[str] = set()
        for name, topic in TOPICS.items():
            callback = partial(self._on_message, name)
            EveryPublisher(self, topic.kind, f"{planner}/{name}", callback, raw=True)
        self.get_logger().info(f"recording {planner} into {folder}")

    def close(self) -> None:
        """Complete the bag."""
        self._writer.close()
        self.get_logger().info(f"{self._writer.count} messages recorded")

    def _on_message(self, topic: str, data: bytes) -> None:
        self._writer.write(BagMessage(topic, self.get_clock().now().nanoseconds, data))
        if topic not in self._received:
            self._received.add(topic)
            self.get_logger().info(f"first message of {topic}")


def run(stop: threading.Event, arguments: list[str]) -> int:
    """Record until an event is set.

    Args:
        stop: the event.
        arguments: the command line.

    Returns:
        The exit code; 2 where an argument cannot be used.
    """
    recorder = node_of_argument(arguments, USAGE, lambda name: BagRecorder(Path(name)))
    if recorder is None:
        return 2
    spinner = Spinner(recorder)
    spinner.spin_until(stop.is_set)
    spinner.spin_until(lambda: False, DRAIN_TIME)
    recorder.close()
    spinner.close()
    return 0
