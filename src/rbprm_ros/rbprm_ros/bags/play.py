"""`play_bag FOLDER`: publish the messages of a bag again, at the rate of the recording.

It runs until it is stopped, since a latched message exists as long as its publisher.
"""

from __future__ import annotations

import threading
import time
from pathlib import Path

from rclpy.node import Node

from rbprm_core.errors import InvalidInput
from rbprm_ros.bags.storage import TOPICS, BagMessage, read_bag
from rbprm_ros.rclpy_utils.spinning import Spinner, node_of_argument

USAGE = (
    "usage: play_bag FOLDER [--ros-args -p rate:=FACTOR -p planner:=NODE -p topics:=[NAME, ...]]\n"
    f"topics: {', '.join(TOPICS)}"
)


class BagPlayer(Node):
    """Publishes a bag's messages as they were on the wire.

    Args:
        folder: folder of the bag.

    Raises:
        InvalidInput: the folder or a parameter cannot be used.
    """

    def __init__(self, folder: Path) -> None:
        super().__init__("bag_player")
        planner = self.declare_parameter("planner", "/rbprm_planner").value
        self._rate = self.declare_parameter("rate", 1.0).value
        topics = self.declare_parameter("topics", list(TOPICS)).value
        if not self._rate > 0.0:
            raise InvalidInput("rate", self._rate, "must be over 0: 2.0 is twice as fast")
        unknown = [name for name in topics if name not in TOPICS]
        if unknown:
            raise InvalidInput("topics", unknown, f"known are {', '.join(TOPICS)}")
        self._messages = [message for message in read_bag(folder) if message.topic in topics]
        self._outputs = {
            name: self.create_publisher(TOPICS[name].kind, f"{planner}/{name}", TOPICS[name].qos)
            for name in {message.topic for message in self._messages}
        }
        self.get_logger().info(f"{len(self._messages)} messages to {planner}")

    def play(self, spinner: Spinner, stop: threading.Event) -> None:
        """Publish all messages.

        Args:
            spinner: runs the node's callbacks meanwhile.
            stop: event that ends the playing.
        """
        started = time.monotonic()
        for message in self._messages:
            due = started + (message.stamp - self._messages[0].stamp) * 1e-9 / self._rate
            spinner.spin_until(stop.is_set, due - time.monotonic())
            if stop.is_set():
                return
            self._publish(message)
        self.get_logger().info("all played")

    def _publish(self, message: BagMessage) -> None:
        self._outputs[message.topic].publish(message.data)


def run(stop: threading.Event, arguments: list[str]) -> int:
    """Play, then run until an event is set.

    Args:
        stop: the event.
        arguments: the command line.

    Returns:
        The exit code; 2 where an argument cannot be used.
    """
    player = node_of_argument(arguments, USAGE, lambda name: BagPlayer(Path(name)))
    if player is None:
        return 2
    spinner = Spinner(player)
    player.play(spinner, stop)
    spinner.spin_until(stop.is_set)
    spinner.close()
    return 0
