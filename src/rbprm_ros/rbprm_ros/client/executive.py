"""`executive`: an example of a mission executive, which executes a plan while surfaces change.

It requests a plan, goes through its states at a constant rate, publishes the executed state, and
continues with every new revision. A robot's controllers would move the robot where this executive
only counts states. It stands still while the status is not VALID, so that no state is entered that
is about to be revised.
"""

from __future__ import annotations

import sys
import threading
import time

from rbprm_msgs.action import PlanContacts
from rbprm_msgs.msg import ContactSequence, PlannerStatus, PlanningResult
from rclpy.exceptions import ParameterException
from rclpy.node import Node

from rbprm_core.errors import InvalidInput, RbprmError
from rbprm_core.scenario import EditText
from rbprm_ros.client.mission import Mission, parts_without_message
from rbprm_ros.client.plan_call import PlanCall
from rbprm_ros.client.planner_client import PlannerClient
from rbprm_ros.demo.perception import Perception
from rbprm_ros.rclpy_utils.spinning import Spinner, init

LOG_PERIOD = 1.0  # seconds between two lines about the progress of planning
STATUS_NAMES = {
    getattr(PlannerStatus, name): name
    for name in ("IDLE", "PLANNING", "VALID", "INVALIDATED", "REPLANNING", "FAILED")
}


class MissionFailed(Exception):
    """The robot will not reach the goal."""


class Executive:
    """Executes a mission.

    Args:
        node: node of the executive.
        spinner: runs the node's callbacks.
        mission: the mission.
        stop: event that ends the mission early.
    """

    def __init__(
        self, node: Node, spinner: Spinner, mission: Mission, stop: threading.Event
    ) -> None:
        self._node, self._spinner, self._mission, self._stop = node, spinner, mission, stop
        self._log = node.get_logger()
        self._client = PlannerClient(
            node,
            mission.planner,
            lambda done, timeout: spinner.spin_until(lambda: done() or stop.is_set(), timeout),
        )
        self._client.watch(on_status=self._log_status)
        self._perception: Perception | None = None
        if mission.surfaces or mission.edits:  # else no publisher at all, which may be forbidden
            self._perception = Perception(node, mission.scenario, mission.planner, mission.frame)
        self._edits = list(mission.scenario.edits) if mission.edits else []
        self._edited = 0.0  # time of the newest edit, seconds of the monotonic clock

    def run(self) -> None:
        """Plan and go to the goal.

        Raises:
            MissionFailed, PlannerTimeout, RbprmError: why the robot did not reach the goal.
        """
        self._client.wait_for_planner(self._mission.timeout)
        if self._perception is not None:
            ready = self._perception.has_subscriber
            self._client.wait_until(ready, "subscriber of the surfaces", self._mission.timeout)
        if self._mission.surfaces:
            self._publish_surfaces()
        else:
            self._wait_for_surfaces()
        self._walk(self._plan())

    def _publish_surfaces(self) -> None:
        """Publish the environment, and wait until the planner knows it."""
        assert self._perception is not None
        ids, end = self._perception.publish_all(), time.monotonic() + self._mission.timeout
        while True:
            known = self._client.environment()
            if known.rejection:
                raise MissionFailed(f"the planner refused the surfaces: {known.rejection}")
            if {surface.id for surface in known.environment.surfaces} == ids:
                return
            if time.monotonic() > end:
                raise MissionFailed("the planner has other surfaces: does another node publish?")
            self._pause(0.05)

    def _wait_for_surfaces(self) -> None:
        """Wait until the planner has received surfaces from another node."""
        end = time.monotonic() + self._mission.timeout
        while not self._client.environment().environment.surfaces and not self._stop.is_set():
            if time.monotonic() > end:
                raise MissionFailed("the planner has no surfaces: does a node publish them?")
            self._pause(0.05)

    def _plan(self) -> ContactSequence:
        """Request the plan and wait for it."""
        request = self._mission.request()
        self._warn_of_parts_without_message()
        call = self._client.plan(request)
        result = self._result(call, self._mission.timeout + request.time_limit).result
        if result.code != PlanningResult.SUCCESS:
            raise MissionFailed(f"no plan (code {result.code}): {result.text}")
        identity = call.result(0.0).sequence.sequence_id
        client = self._client
        client.wait_until(
            lambda: (
                client.sequence is not None
                and client.status is not None
                and client.sequence.sequence_id == client.status.sequence_id == identity
            ),
            "sequence and its status on their topics",
            self._mission.timeout,
        )
        assert client.sequence is not None
        self._log.info(f"plan of {len(client.sequence.states)} states")
        return client.sequence

    def _warn_of_parts_without_message(self) -> None:
        parts = parts_without_message(self._mission.scenario)
        if parts:
            self._log.warning(
                f"the scenario's {', '.join(parts)} cannot be requested: the planner uses its "
                "robot file and its own parameters"
            )

    def _result(self, call: PlanCall, timeout: float) -> PlanContacts.Result:
        """Wait for a call's result and log its progress; cancel a call that takes too long."""
        end = time.monotonic() + timeout
        while not call.done and time.monotonic() < end and not self._stop.is_set():
            self._spinner.spin_until(lambda: call.done or self._stop.is_set(), LOG_PERIOD)
            if call.feedback is not None and not call.done:
                stage, share = call.feedback.stage, call.feedback.fraction
                self._log.info(f"{stage} {share:.0%}, {call.feedback.states} states")
        if not call.done:
            call.cancel()
        return call.result(self._mission.timeout)

    def _walk(self, sequence: ContactSequence) -> None:
        """Go from state to state until the goal."""
        state, moved = 0, time.monotonic()
        while not (sequence.complete and state == len(sequence.states) - 1):
            self._client.executed(sequence, state)
            self._publish_due_edits(state / len(sequence.states))
            self._pause(1.0 / self._mission.rate)
            sequence = self._newest(sequence, state)
            if self._may_enter(sequence, state + 1):
                state, moved = state + 1, time.monotonic()
            elif time.monotonic() - moved > self._mission.timeout:
                reason = "" if self._client.status is None else self._client.status.result.text
                raise MissionFailed(f"stood in state {state} for too long: {reason}")
        self._client.executed(sequence, state)
        self._pause(1.0 / self._mission.rate)  # until the planner has received that
        self._log.info(f"at the goal: state {state}, revision {sequence.revision}")

    def _publish_due_edits(self, share: float) -> None:
        """Publish the edits that are due after a share of the states."""
        while self._perception is not None and self._edits and share >= self._edits[0].at:
            self._publish_edit(self._perception, self._edits.pop(0))

    def _publish_edit(self, perception: Perception, edit: EditText) -> None:
        self._log.info(f"edit: {edit.name}")
        self._edited = time.monotonic()
        perception.publish_edit(edit)

    def _newest(self, sequence: ContactSequence, state: int) -> ContactSequence:
        """The newest revision of a sequence.

        Raises:
            MissionFailed: the sequence cannot be continued from a state.
        """
        newest, status = self._client.sequence, self._client.status
        assert newest is not None  # `_plan` waited for both
        assert status is not None
        # A planner that was started again publishes no sequence, and its status names none.
        if {newest.sequence_id, status.sequence_id} != {sequence.sequence_id}:
            raise MissionFailed("the planner has another sequence, or was stopped or started again")
        if not self._client.found:
            raise MissionFailed("the planner is gone: the remaining states are not validated")
        if newest.revision == sequence.revision:
            return sequence
        first = newest.first_changed_state
        text = f"revision {newest.revision}: {len(newest.states)} states, new from {first}"
        self._log.info(f"{text}, {self._since_edit()}")
        if newest.states[: state + 1] != sequence.states[: state + 1]:
            raise MissionFailed(f"revision {newest.revision} changes states that are executed")
        return newest

    def _may_enter(self, sequence: ContactSequence, state: int) -> bool:
        """Whether the planner's status says that a state of a revision is valid."""
        status = self._client.status
        return (
            status is not None
            and status.state == PlannerStatus.VALID
            and (status.sequence_id, status.revision) == (sequence.sequence_id, sequence.revision)
            and state < status.valid_states
        )

    def _log_status(self, status: PlannerStatus) -> None:
        name = STATUS_NAMES[status.state]
        if status.state == PlannerStatus.INVALIDATED:
            reasons = "; ".join(state.text for state in status.invalid_states[:1])
            count = len(status.invalid_states)
            self._log.info(f"{name}: {count} states, {self._since_edit()}; {reasons}")
        elif status.state == PlannerStatus.FAILED:
            self._log.warning(f"{name}: {status.result.text}")

    def _since_edit(self) -> str:
        return f"{1e3 * (time.monotonic() - self._edited):.0f} ms after the edit"

    def _pause(self, seconds: float) -> None:
        """Wait, while callbacks run.

        Raises:
            MissionFailed: the mission ends early.
        """
        self._spinner.spin_until(self._stop.is_set, seconds)
        if self._stop.is_set():
            raise MissionFailed("stopped by a signal")


def run(stop: threading.Event) -> int:
    """Execute the mission of the node's parameters.

    Args:
        stop: event that ends the mission early.

    Returns:
        The exit code: 0 at the goal, 1 elsewhere, 2 where a parameter is wrong.
    """
    init()
    node = Node("executive")
    spinner = Spinner(node)
    try:
        mission = Mission.from_parameters(node)
    except (InvalidInput, ParameterException) as error:
        print(f"executive: {error}", file=sys.stderr)
        return 2
    try:
        Executive(node, spinner, mission, stop).run()
    except (MissionFailed, TimeoutError, RuntimeError, RbprmError) as error:
        node.get_logger().error(str(error))
        return 1
    finally:
        spinner.close()
    return 0
