"""A stand-in for perception: publishes a scenario's environment and its edits."""

from __future__ import annotations

from rbprm_msgs.msg import SurfaceArray
from rclpy.event_handler import PublisherEventCallbacks
from rclpy.node import Node
from std_msgs.msg import Header

from rbprm_core.environment import polygon_surfaces
from rbprm_core.scenario import EditText, Scenario
from rbprm_core.scene import Surface
from rbprm_core.scene.polygon import MIN_AREA
from rbprm_ros.conversions import surfaces_message
from rbprm_ros.rclpy_utils.qos import STREAM


class Perception:
    """Publishes a scenario's surfaces for a planner.

    Args:
        node: node that publishes.
        scenario: the scenario.
        planner: name of the planner's node.
        frame: the planner's planning frame, in which the surfaces are.
    """

    def __init__(self, node: Node, scenario: Scenario, planner: str, frame: str) -> None:
        self._node, self._scenario, self._frame = node, scenario, frame
        self._publisher = node.create_publisher(
            SurfaceArray,
            f"{planner}/surfaces",
            STREAM,
            # The planner's second reader requests latched messages, by design: no warning.
            event_callbacks=PublisherEventCallbacks(use_default_callbacks=False),
        )

    def has_subscriber(self) -> bool:
        """Whether the topic has a subscriber."""
        return self._publisher.get_subscription_count() > 0

    def publish_all(self) -> set[str]:
        """Publish the whole environment, without edits; returns the ids of its surfaces."""
        surfaces = scenario_surfaces(self._scenario)
        self._publisher.publish(surfaces_message(surfaces, self._header()))
        return {surface.id for surface in surfaces}

    def publish_edit(self, edit: EditText) -> None:
        """Publish the change of an edit.

        Args:
            edit: the edit.

        Raises:
            InvalidInput: a polygon of the edit cannot be used.
        """
        rule = self._scenario.environment.classification
        message = surfaces_message(
            polygon_surfaces(edit.surfaces, rule, f"edit {edit.name!r}"), self._header()
        )
        message.is_diff, message.removed_ids = True, list(edit.removed)
        self._publisher.publish(message)

    def _header(self) -> Header:
        return Header(stamp=self._node.get_clock().now().to_msg(), frame_id=self._frame)


def scenario_surfaces(scenario: Scenario) -> tuple[Surface, ...]:
    """The surfaces of a scenario's environment, without slivers too small for a polygon.

    Args:
        scenario: the scenario.

    Raises:
        InvalidInput: the environment cannot be read.
    """
    return tuple(s for s in scenario.scene().surfaces if s.polygon.area > MIN_AREA)
