"""Messages of latched and volatile publishers arrive once, in the order of sending."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

import pytest
from rclpy.duration import Duration
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.publisher import Publisher
from std_msgs.msg import Int32

from rbprm_ros.rclpy_utils.qos import LATCHED_STREAM, STREAM
from rbprm_ros.rclpy_utils.subscription import EveryPublisher

if TYPE_CHECKING:
    from conftest import Site

TOPIC = "/numbers"
TIMEOUT = 60.0  # seconds
Spin = Callable[[Callable[[], bool]], None]


@pytest.fixture
def talker(site: Site) -> Iterator[Node]:
    made = Node("talker", context=site.context)
    yield made
    made.destroy_node()


@pytest.fixture
def listener(site: Site) -> Iterator[Node]:
    made = Node("listener", context=site.context)
    yield made
    made.destroy_node()


@pytest.fixture
def spin(site: Site, listener: Node) -> Iterator[Spin]:
    """Runs the subscriber's callbacks until a condition holds, and a little longer."""
    executor = SingleThreadedExecutor(context=site.context)
    executor.add_node(listener)

    def spin_until(done: Callable[[], bool]) -> None:
        end = time.monotonic() + TIMEOUT
        while not done():
            assert time.monotonic() < end
            executor.spin_once(0.05)
        for _ in range(20):
            executor.spin_once(0.01)

    yield spin_until
    executor.shutdown()


def arrived(publisher: Publisher) -> None:
    """Wait until all readers have received the published messages."""
    assert publisher.wait_for_all_acked(Duration(seconds=TIMEOUT))


def test_what_was_latched_comes_before_what_is_sent_later(
    talker: Node, listener: Node, spin: Spin
) -> None:
    latched = talker.create_publisher(Int32, TOPIC, LATCHED_STREAM)
    for number in range(6):
        latched.publish(Int32(data=number))
    heard: list[int] = []

    def take(message: Int32) -> None:
        if not heard:
            latched.publish(Int32(data=6))
            arrived(latched)
        heard.append(message.data)

    EveryPublisher(listener, Int32, TOPIC, take)
    spin(lambda: len(heard) >= 7)
    assert heard == list(range(7))


def test_volatile_and_latched_publishers_are_heard_once_each(
    talker: Node, listener: Node, spin: Spin
) -> None:
    publishers = [talker.create_publisher(Int32, TOPIC, qos) for qos in (LATCHED_STREAM, STREAM)]
    heard: list[int] = []
    EveryPublisher(listener, Int32, TOPIC, lambda message: heard.append(message.data))
    # Both readers of the first subscriber, and one of the second.
    spin(lambda: [p.get_subscription_count() for p in publishers] == [2, 1])
    for number in range(6):
        publishers[number % 2].publish(Int32(data=number))
        arrived(publishers[number % 2])
    spin(lambda: len(heard) >= 6)
    assert heard == list(range(6))
