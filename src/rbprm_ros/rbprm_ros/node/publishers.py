"""The node's publishers, and the messages of plans in its answers."""

from __future__ import annotations

import functools
import traceback
from collections.abc import Callable, Sequence
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import Path
from rbprm_msgs.msg import ContactSequence, PlanningResult
from rbprm_msgs.msg import PlannerStatus as PlannerStatusMessage
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
from rbprm_ros.errors import error_data
from rbprm_ros.planning.planning import Planning
from rbprm_ros.planning.sequence import PublishedSequence
from rbprm_ros.planning.status import PlannerStatus
from rbprm_ros.rclpy_utils.qos import CALLS, LATCHED
from rbprm_ros.settings import Settings
from rbprm_ros.workers.jobs import Job, RobotChoice

Answer = Any  # Plan.Response, Replan.Response or PlanContacts.Result: the same four fields


class Publishers:
    """The node's publishers.

    Args:
        node: the planner's node.
        settings: returns the current parameters.
    """

    def __init__(self, node: Node, settings: Callable[[], Settings]) -> None:
        self._node, self._settings = node, settings
        self._sequence = node.create_publisher(ContactSequence, "~/contact_sequence", LATCHED)
        self._partial = node.create_publisher(ContactSequence, "~/partial_sequence", CALLS)
        self._guide = node.create_publisher(Path, "~/guide_path", LATCHED)
        self._markers = node.create_publisher(MarkerArray, "~/markers", LATCHED)
        self._diagnostics = node.create_publisher(DiagnosticArray, "/diagnostics", CALLS)
        self._status = node.create_publisher(PlannerStatusMessage, "~/status", LATCHED)

    def header(self) -> Header:
        """A header with the time of now and the planning frame."""
        stamp = self._node.get_clock().now().to_msg()
        return Header(stamp=stamp, frame_id=self._settings().planning_frame)

    def sequence(self, sequence: PublishedSequence) -> None:
        """Publish a revision and its guide.

        Args:
            sequence: the revision.
        """
        header = self._header_of(sequence)
        self._guide.publish(guide_message(sequence.plan, header))
        self._sequence.publish(self._message(sequence, header))
        count, revision = len(sequence.plan.states), sequence.revision
        text = f"sequence {sequence.id[:8]}, revision {revision}: {count} states"
        self._node.get_logger().info(text)

    def withdraw_sequence(self) -> None:
        """Replace the latched sequence and guide by empty ones."""
        header = self.header()
        self._guide.publish(Path(header=header))
        self._sequence.publish(ContactSequence(header=header))

    def status(self, status: PlannerStatus, sequence: PublishedSequence | None) -> None:
        """Publish the status.

        Args:
            status: the status.
            sequence: the published sequence; None where there is none.
        """
        header = Header(stamp=self._node.get_clock().now().to_msg())
        self._status.publish(status_message(header, status, sequence))

    def markers(self, snapshot: Snapshot, plan: ContactPlan | None) -> bool:
        """Publish the markers of environment and plan; False where the topic has no subscriber.

        Args:
            snapshot: the environment.
            plan: the published plan; None where there is none.
        """
        if self._markers.get_subscription_count() == 0:
            return False
        self._markers.publish(markers_message(self.header(), snapshot, plan))
        return True

    def diagnostics(self, planning: Planning, environment: Environment, calls: int) -> None:
        """Publish the diagnostics.

        Args:
            planning: processes and published sequence.
            environment: the environment.
            calls: number of calls and goals without an answer yet.
        """
        now = self._node.get_clock().now()
        stamp, published = environment.snapshot.stamp, planning.published
        health = Health(
            worker_alive=planning.processes_alive,
            restarts=planning.restarts,
            environment_version=environment.version,
            environment_age=(now.nanoseconds - stamp) / 1e9 if stamp else None,
            rejection=environment.rejection,
            planning_time=published.plan.statistics.time.get("total") if published else None,
            queue=calls,
        )
        header = Header(stamp=now.to_msg())
        self._diagnostics.publish(diagnostics_message(health, header, self._node.get_name()))

    def partial(self, job: Job, states: Sequence[StateEntry]) -> None:
        """Publish the states of a sequence that is growing.

        Args:
            job: work that gives the sequence.
            states: states of the sequence so far.
        """
        if self._partial.get_subscription_count() == 0:
            return
        plan = bare_plan(states, job.request, _robot(job.robot))
        self._partial.publish(self._incomplete(plan, job.id))

    def answer(self, sequence: PublishedSequence, answer: Answer) -> None:
        """Fill an answer with a plan.

        Args:
            sequence: the published plan.
            answer: response or result to fill.
        """
        header = self._header_of(sequence)
        answer.sequence = self._message(sequence, header)
        answer.guide = guide_message(sequence.plan, header)
        answer.statistics = statistics_message(sequence.plan)
        answer.result = success_message(sequence.plan)

    def answer_partly(self, plan: ContactPlan, answer: Answer) -> None:
        """Fill the answer of a goal that failed with the states that were found.

        Args:
            plan: plan of the states that were found.
            answer: result to fill.
        """
        answer.sequence = self._incomplete(plan, "")
        answer.statistics = statistics_message(plan)

    def refusal(self, error: Exception) -> PlanningResult:
        """Log an error and return it as a message.

        Args:
            error: any exception of planning or serving.
        """
        data = error_data(error)
        if not isinstance(error, RbprmError):
            self._node.get_logger().error("".join(traceback.format_exception(error)))
        self._node.get_logger().warning(f"refused: {data.code.name}: {data.text}")
        return result_message(data)

    def _header_of(self, sequence: PublishedSequence) -> Header:
        frame = self._settings().planning_frame
        return Header(stamp=time_message(sequence.stamp), frame_id=frame)

    def _message(self, sequence: PublishedSequence, header: Header) -> ContactSequence:
        return sequence_message(
            sequence.plan,
            header,
            sequence.id,
            sequence.surfaces_stamp,
            revision=sequence.revision,
            first_changed=sequence.first_changed,
            complete=sequence.complete,
        )

    def _incomplete(self, plan: ContactPlan, identity: str) -> ContactSequence:
        return sequence_message(plan, self.header(), identity, 0, complete=False)


@functools.lru_cache(maxsize=4)
def _robot(choice: RobotChoice) -> Robot:
    """A robot; loading it takes longer than the time between two partial sequences."""
    return Robot.load(choice.description())
