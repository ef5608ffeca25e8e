"""`publish_surfaces SCENARIO`: a stand-in for perception.

Reads a scenario's environment and publishes all its surfaces and obstacles as one latched
snapshot. Stays up until stopped, since a latched message lives as long as its publisher.
"""

from __future__ import annotations

import threading

from rbprm_msgs.msg import SurfaceArray
from rclpy.node import Node
from std_msgs.msg import Header

from rbprm_core.scenario import Scenario, load_scenario
from rbprm_core.scene import Surface
from rbprm_core.scene.polygon import LEAST_AREA
from rbprm_ros.conversions import surfaces_message
from rbprm_ros.conversions.meshes import LEAST_TRIANGLE, areas
from rbprm_ros.environment import Obstacle
from rbprm_ros.qos import LATCHED
from rbprm_ros.spinning import Spinner, node_of_argument

USAGE = "usage: publish_surfaces SCENARIO [--ros-args -p topic:=NAME -p frame_id:=FRAME]"


class SurfacePublisher(Node):
    """Publishes some surfaces and obstacles once, latched."""

    def __init__(self, surfaces: tuple[Surface, ...], obstacles: tuple[Obstacle, ...] = ()) -> None:
        super().__init__("surface_publisher")
        topic = self.declare_parameter("topic", "/rbprm_planner/surfaces").value
        frame = self.declare_parameter("frame_id", "map").value
        publisher = self.create_publisher(SurfaceArray, topic, LATCHED)
        header = Header(stamp=self.get_clock().now().to_msg(), frame_id=frame)
        publisher.publish(surfaces_message(surfaces, header, obstacles))
        self.get_logger().info(
            f"{len(surfaces)} surfaces, {len(obstacles)} obstacles on {publisher.topic_name}"
        )


def scenario_environment(scenario: Scenario) -> tuple[tuple[Surface, ...], tuple[Obstacle, ...]]:
    """Surfaces and obstacles of a scenario's environment, slivers that are no polygon left out.

    Raises:
        InvalidInput: an environment that cannot be read.
    """
    scene = scenario.scene()
    surfaces = tuple(s for s in scene.surfaces if s.polygon.area > LEAST_AREA)
    solid = scene.obstacles[areas(scene.obstacles) >= LEAST_TRIANGLE]
    return surfaces, (Obstacle(scenario.name, solid),) if len(solid) else ()


def run(stop: threading.Event, arguments: list[str]) -> int:
    """Publish until the event is set; returns the exit code, 2 where the scenario is no good."""
    publisher = node_of_argument(
        arguments,
        USAGE,
        lambda name: SurfacePublisher(*scenario_environment(load_scenario(name))),
    )
    if publisher is None:
        return 2
    spinner = Spinner(publisher)
    spinner.spin_until(stop.is_set)
    spinner.close()
    return 0
