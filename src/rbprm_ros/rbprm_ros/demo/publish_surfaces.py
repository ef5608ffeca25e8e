"""`publish_surfaces SCENARIO`: a stand-in for perception.

It reads a scenario's environment and publishes all its surfaces as one latched snapshot. It runs
until it is stopped, since a latched message exists as long as its publisher.
"""

from __future__ import annotations

import threading
from collections.abc import Sequence

from rbprm_msgs.msg import SurfaceArray
from rclpy.node import Node
from std_msgs.msg import Header

from rbprm_core.scenario import load_scenario
from rbprm_core.scene import Surface
from rbprm_ros.conversions import surfaces_message
from rbprm_ros.demo.perception import scenario_surfaces
from rbprm_ros.rclpy_utils.qos import LATCHED
from rbprm_ros.rclpy_utils.spinning import Spinner, node_of_argument

USAGE = "usage: publish_surfaces SCENARIO [--ros-args -p topic:=NAME -p frame_id:=FRAME]"


class SurfacePublisher(Node):
    """Publishes surfaces once, latched.

    Args:
        surfaces: the surfaces.
    """

    def __init__(self, surfaces: Sequence[Surface]) -> None:
        super().__init__("surface_publisher")
        topic = self.declare_parameter("topic", "/rbprm_planner/surfaces").value
        frame = self.declare_parameter("frame_id", "map").value
        publisher = self.create_publisher(SurfaceArray, topic, LATCHED)
        header = Header(stamp=self.get_clock().now().to_msg(), frame_id=frame)
        publisher.publish(surfaces_message(surfaces, header))
        self.get_logger().info(f"{len(surfaces)} surfaces on {publisher.topic_name}")


def run(stop: threading.Event, arguments: list[str]) -> int:
    """Publish until an event is set.

    Args:
        stop: the event.
        arguments: the command line.

    Returns:
        The exit code; 2 where the scenario cannot be used.
    """
    publisher = node_of_argument(
        arguments,
        USAGE,
        lambda name: SurfacePublisher(scenario_surfaces(load_scenario(name))),
    )
    if publisher is None:
        return 2
    spinner = Spinner(publisher)
    spinner.spin_until(stop.is_set)
    spinner.close()
    return 0
