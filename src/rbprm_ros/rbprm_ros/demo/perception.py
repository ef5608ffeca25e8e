"""A scenario's environment and its edits, as perception would send them."""

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
    """Publishes surfaces for a planner.

    Args:
        planner: name of the planner's node. frame: of the surfaces, its planning frame.
    """

    def __init__(self, node: Node, scenario: Scenario, planner: str, frame: str) -> None:
        self._node, self._scenario, self._frame = node, scenario, frame
        self._publisher = node.create_publisher(
            SurfaceArray,
            f"{planner}/surfaces",
            STREAM,
            # The planner's second reader wants latched messages, by intention: no warning.
            event_callbacks=PublisherEventCallbacks(use_default_callbacks=False),
        )

    def heard(self) -> bool:
        """Whether anybody listens."""
        return self._publisher.get_subscription_count() > 0

    def see_all(self) -> set[str]:
        """Publish the whole environment, without edits; returns the ids of its surfaces."""
        surfaces = scenario_surfaces(self._scenario)
        self._publisher.publish(surfaces_message(surfaces, self._header()))
        return {surface.id for surface in surfaces}

    def see_edit(self, edit: EditText) -> None:
        """Publish what an edit changes, and nothing else.

        Raises:
            InvalidInput: a polygon of the edit that cannot be used.
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
    """Surfaces of a scenario's environment, slivers that are no polygon left out.

    Raises:
        InvalidInput: an environment that cannot be read.
    """
    return tuple(s for s in scenario.scene().surfaces if s.polygon.area > MIN_AREA)
