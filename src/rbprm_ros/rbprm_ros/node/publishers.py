"""What the node publishes, and what it answers plans with."""

from __future__ import annotations

import functools
import traceback
from collections.abc import Callable, Sequence
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import Path
from rbprm_msgs.msg import ContactSequence, PlannerStatus, PlanningResult
from rclpy.node import Node
from std_msgs.msg import Header
from visualization_msgs.msg import MarkerArray

from rbprm_core.errors import RbprmError
from rbprm_core.plan_conversion.states_to_plan import bare_plan
from rbprm_core.plan_record import ContactPlan, StateEntry
from rbprm_core.robot import Robot
from rbprm_ros.conversions import (
    diagnostics_message,
    guide_message,
    markers_message,
    result_message,
    sequence_message,
    statistics_message,
    status_message,
    success_message,
    time_message,
)
from rbprm_ros.conversions.diagnostics import Health
from rbprm_ros.environment.snapshot import Snapshot
from rbprm_ros.environment.store import Environment
from rbprm_ros.failure import failure_of
from rbprm_ros.planning.planning import Planning
from rbprm_ros.planning.published import Published, Standing
from rbprm_ros.rclpy_utils.qos import CALLS, LATCHED
from rbprm_ros.settings import Settings
from rbprm_ros.workers.jobs import Job, RobotChoice

Answer = Any  # Plan.Response, Replan.Response or PlanContacts.Result: the same four fields


class Outbox:
    """The node's publishers.

    Args:
        settings: gives the parameters of now.
    """

    def __init__(self, node: Node, settings: Callable[[], Settings]) -> None:
        self._node, self._settings = node, settings
        self._sequence = node.create_publisher(ContactSequence, "~/contact_sequence", LATCHED)
        self._partial = node.create_publisher(ContactSequence, "~/partial_sequence", CALLS)
        self._guide = node.create_publisher(Path, "~/guide_path", LATCHED)
        self._markers = node.create_publisher(MarkerArray, "~/markers", LATCHED)
        self._diagnostics = node.create_publisher(DiagnosticArray, "/diagnostics", CALLS)
        self._status = node.create_publisher(PlannerStatus, "~/status", LATCHED)

    def header(self) -> Header:
        """Of now, in the planning frame."""
        stamp = self._node.get_clock().now().to_msg()
        return Header(stamp=stamp, frame_id=self._settings().planning_frame)

    def sequence(self, published: Published) -> None:
        """Publish a revision and its guide."""
        header = self._header_of(published)
        self._guide.publish(guide_message(published.plan, header))
        self._sequence.publish(self._message(published, header))
        count, revision = len(published.plan.states), published.revision
        text = f"sequence {published.id[:8]}, revision {revision}: {count} states"
        self._node.get_logger().info(text)

    def nothing(self) -> None:
        """Take the latched sequence back: the node knows of none."""
        header = self.header()
        self._guide.publish(Path(header=header))
        self._sequence.publish(ContactSequence(header=header))

    def status(self, standing: Standing, published: Published | None) -> None:
        """Publish how the planner stands."""
        header = Header(stamp=self._node.get_clock().now().to_msg())
        self._status.publish(status_message(header, standing, published))

    def markers(self, snapshot: Snapshot, plan: ContactPlan | None) -> bool:
        """Publish what there is to see; False where nobody looks."""
        if self._markers.get_subscription_count() == 0:
            return False
        self._markers.publish(markers_message(self.header(), snapshot, plan))
        return True

    def health(self, planning: Planning, environment: Environment, calls: int) -> None:
        """Publish how the node does."""
        now = self._node.get_clock().now()
        stamp, published = environment.snapshot.stamp, planning.published
        health = Health(
            worker_alive=planning.planner.alive and planning.watcher.alive,
            restarts=planning.planner.restarts + planning.watcher.restarts,
            environment_version=environment.version,
            environment_age=(now.nanoseconds - stamp) / 1e9 if stamp else None,
            rejection=environment.rejection,
            planning_time=published.plan.statistics.time.get("total") if published else None,
            queue=calls,
        )
        header = Header(stamp=now.to_msg())
        self._diagnostics.publish(diagnostics_message(health, header, self._node.get_name()))

    def partial(self, job: Job, states: Sequence[StateEntry]) -> None:
        """Publish the states of a sequence that grows."""
        if self._partial.get_subscription_count() == 0:
            return
        plan = bare_plan(states, job.request, _robot(job.robot))
        self._partial.publish(self._part(plan, job.id))

    def answer(self, published: Published, answer: Answer) -> None:
        """Fill an answer with a plan."""
        header = self._header_of(published)
        answer.sequence = self._message(published, header)
        answer.guide = guide_message(published.plan, header)
        answer.statistics = statistics_message(published.plan)
        answer.result = success_message(published.plan)

    def answer_partly(self, plan: ContactPlan, answer: Answer) -> None:
        """Fill a failure's answer with the states that were found."""
        answer.sequence = self._part(plan, "")
        answer.statistics = statistics_message(plan)

    def refusal(self, error: Exception) -> PlanningResult:
        """An error as an answer; it is logged."""
        failure = failure_of(error)
        if not isinstance(error, RbprmError):
            self._node.get_logger().error("".join(traceback.format_exception(error)))
        self._node.get_logger().warning(f"refused: {failure.code.name}: {failure.text}")
        return result_message(failure)

    def _header_of(self, published: Published) -> Header:
        frame = self._settings().planning_frame
        return Header(stamp=time_message(published.stamp), frame_id=frame)

    def _message(self, published: Published, header: Header) -> ContactSequence:
        return sequence_message(
            published.plan,
            header,
            published.id,
            published.surfaces_stamp,
            revision=published.revision,
            first_changed=published.first_changed,
            complete=published.complete,
        )

    def _part(self, plan: ContactPlan, identity: str) -> ContactSequence:
        return sequence_message(plan, self.header(), identity, 0, complete=False)


@functools.lru_cache(maxsize=4)
def _robot(choice: RobotChoice) -> Robot:
    """A robot; loading takes longer than the time between two partial sequences."""
    return Robot.load(choice.description())
