"""`executive`: an example of a mission executive, which walks a plan while its surroundings change.

It asks for a plan, goes through its states at a steady rate, tells the planner where it is, and
goes on with every revision. A robot's controllers would be where this one only counts. It stands
still while the planner says anything but VALID: no state is entered that is about to be revised.
"""

from __future__ import annotations

import sys
import threading
import time
from dataclasses import dataclass

from rbprm_msgs.action import PlanContacts
from rbprm_msgs.msg import ContactSequence, PlannerStatus, PlanningResult
from rbprm_msgs.srv import Plan
from rclpy.exceptions import ParameterException
from rclpy.node import Node

from rbprm_core.errors import InvalidInput, RbprmError
from rbprm_core.request import PlannerOptions
from rbprm_core.scenario import EditText, Scenario, TrunkText, load_scenario
from rbprm_core.scene import Classification
from rbprm_core.validation import finite_number
from rbprm_ros.client import PlanCall, PlannerClient
from rbprm_ros.conversions import request_message
from rbprm_ros.demo.perception import Perception
from rbprm_ros.rclpy_utils.spinning import Spinner, init

LOG_PERIOD = 1.0  # seconds between two lines about planning that goes on
STATUS_NAMES = {
    getattr(PlannerStatus, name): name
    for name in ("IDLE", "PLANNING", "VALID", "INVALIDATED", "REPLANNING", "FAILED")
}


class MissionFailed(Exception):
    """The goal will not be reached."""


@dataclass(frozen=True)
class Mission:
    """What is to be done; the node's parameters.

    Attributes:
        scenario: whose request is planned. seed: of the planner.
        planner: name of the planner's node. frame: its planning frame.
        surfaces, edits: whether perception is played too: the environment at the beginning, and
            the scenario's edits, each when its share of the states has been executed.
        rate: states per second. timeout: seconds to wait for the planner, or while it stands still.
    """

    scenario: Scenario
    seed: int
    planner: str
    frame: str
    surfaces: bool
    edits: bool
    rate: float
    timeout: float

    @classmethod
    def declared(cls, node: Node) -> Mission:
        """The mission that a node's parameters ask for.

        Raises:
            InvalidInput, ParameterException: a parameter that cannot be used.
        """
        seed = node.declare_parameter("seed", 0).value
        if seed < 0:
            raise InvalidInput("seed", seed, "must not be negative")
        rate = finite_number("rate", node.declare_parameter("rate", 5.0).value, low=0.1)
        timeout = finite_number("timeout", node.declare_parameter("timeout", 60.0).value, low=0.0)
        return cls(
            scenario=load_scenario(node.declare_parameter("scenario", "replanning").value),
            seed=seed,
            planner=node.declare_parameter("planner", "/rbprm_planner").value,
            frame=node.declare_parameter("frame_id", "map").value,
            surfaces=node.declare_parameter("surfaces", True).value,
            edits=node.declare_parameter("edits", True).value,
            rate=rate,
            timeout=timeout,
        )


class Executive:
    """Carries a mission out.

    Args:
        stop: ends the mission early.
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
        self._client.watch(on_status=self._tell_status)
        self._perception: Perception | None = None
        if mission.surfaces or mission.edits:  # else not even a publisher: it may be forbidden
            self._perception = Perception(node, mission.scenario, mission.planner, mission.frame)
        self._edits = list(mission.scenario.edits) if mission.edits else []
        self._edited = 0.0  # when the newest edit was sent

    def run(self) -> None:
        """Plan and walk to the goal.

        Raises:
            MissionFailed, PlannerTimeout, RbprmError: why the robot is not there.
        """
        self._client.wait_for_planner(self._mission.timeout)
        if self._perception is not None:
            heard = self._perception.heard
            self._client.wait_until(heard, "subscriber of the surfaces", self._mission.timeout)
        if self._mission.surfaces:
            self._see_all()
        else:
            self._wait_for_surfaces()
        self._walk(self._plan())

    def _see_all(self) -> None:
        """Send the environment, and wait until the planner has it."""
        assert self._perception is not None
        ids, end = self._perception.see_all(), time.monotonic() + self._mission.timeout
        while True:
            known = self._client.environment()
            if known.rejection:
                raise MissionFailed(f"the planner refused the surfaces: {known.rejection}")
            if {surface.id for surface in known.environment.surfaces} == ids:
                return
            if time.monotonic() > end:
                raise MissionFailed("the planner has other surfaces: who else publishes them?")
            self._pause(0.05)

    def _wait_for_surfaces(self) -> None:
        """Wait until others have sent the planner something to stand on."""
        end = time.monotonic() + self._mission.timeout
        while not self._client.environment().environment.surfaces and not self._stop.is_set():
            if time.monotonic() > end:
                raise MissionFailed("the planner has no surfaces: who publishes them?")
            self._pause(0.05)

    def _plan(self) -> ContactSequence:
        """Ask for the plan and wait for it."""
        request = self._request()
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

    def _request(self) -> Plan.Request:
        scenario = self._mission.scenario
        robot = scenario.load_robot()
        limit = scenario.request_text(robot.name).time_limit
        request = scenario.request_for(robot, self._mission.seed)
        message = request_message(request, scenario.robot, limit, self._mission.frame)
        message.limbs = list(scenario.limbs or ())
        message.root_joints = list(scenario.root_joints or ())
        lost = not_asked_for(scenario)
        if lost:
            names = ", ".join(lost)
            self._log.warning(
                f"the scenario's {names} cannot be asked for: the planner goes by its robot file "
                "and its own parameters"
            )
        return message

    def _result(self, call: PlanCall, timeout: float) -> PlanContacts.Result:
        """Wait for a call's result, telling how it goes; cancelled where it takes too long."""
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
            self._play_edits(state / len(sequence.states))
            self._pause(1.0 / self._mission.rate)
            sequence = self._newest(sequence, state)
            if self._may_enter(sequence, state + 1):
                state, moved = state + 1, time.monotonic()
            elif time.monotonic() - moved > self._mission.timeout:
                reason = "" if self._client.status is None else self._client.status.result.text
                raise MissionFailed(f"stood in state {state} for too long: {reason}")
        self._client.executed(sequence, state)
        self._pause(1.0 / self._mission.rate)  # the planner is to hear of it
        self._log.info(f"at the goal: state {state}, revision {sequence.revision}")

    def _play_edits(self, share: float) -> None:
        """Have perception tell the edits whose time has come."""
        while self._perception is not None and self._edits and share >= self._edits[0].at:
            self._play(self._perception, self._edits.pop(0))

    def _play(self, perception: Perception, edit: EditText) -> None:
        self._log.info(f"edit: {edit.name}")
        self._edited = time.monotonic()
        perception.see_edit(edit)

    def _newest(self, sequence: ContactSequence, state: int) -> ContactSequence:
        """The newest revision of a sequence.

        Raises:
            MissionFailed: it is none that can be gone on with from a state.
        """
        newest, status = self._client.sequence, self._client.status
        assert newest is not None  # `_plan` waited for both
        assert status is not None
        # One that was started again publishes no sequence, but its status names none.
        if {newest.sequence_id, status.sequence_id} != {sequence.sequence_id}:
            raise MissionFailed("the planner has another sequence, or was stopped or started again")
        if not self._client.found:
            raise MissionFailed("the planner is gone, and nobody looks whether the rest holds")
        if newest.revision == sequence.revision:
            return sequence
        first = newest.first_changed_state
        text = f"revision {newest.revision}: {len(newest.states)} states, new from {first}"
        self._log.info(f"{text}, {self._since_edit()}")
        if newest.states[: state + 1] != sequence.states[: state + 1]:
            raise MissionFailed(f"revision {newest.revision} changes states that are over")
        return newest

    def _may_enter(self, sequence: ContactSequence, state: int) -> bool:
        """Whether the planner vouches for a state of a revision."""
        status = self._client.status
        return (
            status is not None
            and status.state == PlannerStatus.VALID
            and (status.sequence_id, status.revision) == (sequence.sequence_id, sequence.revision)
            and state < status.valid_states
        )

    def _tell_status(self, status: PlannerStatus) -> None:
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
        """Let time pass, while callbacks are served.

        Raises:
            MissionFailed: it is to end early.
        """
        self._spinner.spin_until(self._stop.is_set, seconds)
        if self._stop.is_set():
            raise MissionFailed("stopped by a signal")


def not_asked_for(scenario: Scenario) -> list[str]:
    """The parts of a scenario that say how to plan, and that no message carries."""
    parts = {
        "[heuristics]": bool(scenario.heuristics),
        "[surfaces]": bool(scenario.surfaces),
        "[trunk]": scenario.trunk != TrunkText(),
        "[options]": scenario.options != PlannerOptions(),
        "[environment.classification]": scenario.environment.classification != Classification(),
    }
    return [name for name, given in parts.items() if given]


def run(stop: threading.Event) -> int:
    """Carry the mission out; returns the exit code: 0 at the goal, 1 elsewhere, 2 where a parameter
    is wrong."""
    init()
    node = Node("executive")
    spinner = Spinner(node)
    try:
        mission = Mission.declared(node)
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
