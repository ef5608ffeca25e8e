"""The node's services."""

from __future__ import annotations

from collections import Counter
from collections.abc import Awaitable, Callable
from typing import Any

from rbprm_msgs.srv import GetEnvironment, ListRobots, Plan, Replan, SetEnvironment, Validate
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node

from rbprm_core.errors import InvalidInput
from rbprm_core.robot import known_robots
from rbprm_core.validation import one_of
from rbprm_ros.conversions import (
    environment_message,
    invalid_state_messages,
    job_of_message,
    read_sequence,
    replan_job_of_message,
    result_message,
    robot_messages,
    time_message,
    update_of_setting,
)
from rbprm_ros.errors import NodeCode, NodeError
from rbprm_ros.node.environment_inputs import EnvironmentInputs
from rbprm_ros.node.progress_log import ProgressLog
from rbprm_ros.node.publishers import Publishers
from rbprm_ros.planning.planning import Planning
from rbprm_ros.planning.sequence import PublishedSequence
from rbprm_ros.rclpy_utils.qos import CALLS
from rbprm_ros.settings import Settings
from rbprm_ros.workers.jobs import RobotChoice


class Services:
    """Serves the node's services; every call gets an answer, with its error in `result`.

    Args:
        node: the planner's node.
        settings: returns the current parameters.
        planning: returns the planning; raises NOT_ACTIVE while the node is not active.
        inputs: the environment.
        publishers: the node's publishers, which make the messages of plans too.
    """

    def __init__(
        self,
        node: Node,
        settings: Callable[[], Settings],
        planning: Callable[[], Planning],
        inputs: EnvironmentInputs,
        publishers: Publishers,
    ) -> None:
        self._node, self._settings, self._planning = node, settings, planning
        self._inputs, self._publishers = inputs, publishers
        self._calls: Counter[str] = Counter()  # without an answer yet, by name of the service
        self._serve(Plan, "~/plan", self._plan)
        self._serve(Replan, "~/replan", self._replan)
        self._serve(Validate, "~/validate", self._validate)
        self._serve(GetEnvironment, "~/get_environment", self._get_environment)
        self._serve(SetEnvironment, "~/set_environment", self._set_environment)
        self._serve(ListRobots, "~/list_robots", self._list_robots)

    @property
    def calls(self) -> int:
        """Number of calls without an answer yet."""
        return self._calls.total()

    def _serve(self, kind: Any, name: str, serve: Callable[[Any, Any], Awaitable[None]]) -> None:
        """Offer a service.

        Args:
            kind: class of the service.
            name: its name.
            serve: fills in the response to a request.
        """

        async def answer(request: Any, response: Any) -> Any:
            self._calls[name] += 1
            try:
                if hasattr(response, "result"):  # services without one are answered at once
                    limit = self._settings().max_calls
                    require_room(limit, f"calls of {name}", self._calls[name])
                await self._inputs.settled()
                await serve(request, response)
            except Exception as error:
                refusal = self._publishers.refusal(error)
                if hasattr(response, "result"):
                    response.result = refusal
            finally:
                self._calls[name] -= 1
            return response

        self._node.create_service(
            kind,
            name,
            answer,
            qos_profile=CALLS,
            callback_group=ReentrantCallbackGroup(),  # a call waits while the next comes in
        )

    async def _plan(self, request: Plan.Request, response: Plan.Response) -> None:
        planning = self._planning()
        job = job_of_message(request, self._settings(), self._inputs.environment)
        log = ProgressLog(self._node.get_logger(), f"plan {job.id[:8]}")
        sequence = await planning.calls.plan(job, lambda reported: log(reported.progress))
        self._publishers.answer(sequence, response)

    async def _replan(self, request: Replan.Request, response: Replan.Response) -> None:
        planning = self._planning()
        base = published_sequence(planning, request.sequence_id)
        default = 0
        if request.from_state == -1 and not request.measured_state:
            default = await planning.calls.last_valid_state(base)
        settings, environment = self._settings(), self._inputs.environment
        job = replan_job_of_message(request, base, default, settings, environment)
        executed = planning.tracker.executed
        if not job.measured and len(job.kept) <= executed:
            reason = f"the robot is in state {executed} already; give that or a later one"
            raise InvalidInput("from_state", request.from_state, reason)
        self._publishers.answer(await planning.calls.replan(job, base), response)

    async def _validate(self, request: Validate.Request, response: Validate.Response) -> None:
        planning, sequence = self._planning(), request.sequence
        if sequence.states:
            base = planning.published
            own = base is not None and base.id == sequence.sequence_id
            known = (*known_robots(), self._settings().robot)
            name = one_of("sequence.robot", sequence.robot, known)
            robot = base.job.robot if own and base else RobotChoice(name)
            limbs = len(robot.description().limbs)
            plan = read_sequence(sequence, self._settings().max_states, limbs)
            found = planning.validator.validate(robot, plan, request.from_state)
        else:
            base = published_sequence(planning, sequence.sequence_id)
            found = planning.validator.validate_published(base, request.from_state)
        snapshot = self._inputs.environment.snapshot
        invalid = await found
        response.valid = not invalid
        response.invalid_states = invalid_state_messages(invalid)
        response.environment_version = snapshot.version
        response.surfaces_stamp = time_message(snapshot.stamp)
        response.result = result_message()

    async def _get_environment(
        self, request: GetEnvironment.Request, response: GetEnvironment.Response
    ) -> None:
        environment = self._inputs.environment
        snapshot = environment.snapshot
        response.environment = environment_message(snapshot, self._publishers.header())
        response.environment_version = snapshot.version
        response.rejection = environment.rejection

    async def _set_environment(
        self, request: SetEnvironment.Request, response: SetEnvironment.Response
    ) -> None:
        update = update_of_setting(request, self._settings())
        try:
            await self._inputs.add(update)
        except InvalidInput as error:
            field = "mesh" if request.mesh else f"environment.{error.field}"
            raise InvalidInput(field, error.value, error.reason) from error
        snapshot = self._inputs.environment.snapshot
        response.surfaces = len(snapshot.surfaces)
        response.obstacles = len(snapshot.obstacles)
        response.environment_version = snapshot.version
        response.result = result_message()

    async def _list_robots(
        self, request: ListRobots.Request, response: ListRobots.Response
    ) -> None:
        response.default_robot = self._settings().robot
        response.robots = robot_messages(response.default_robot)


def published_sequence(planning: Planning, sequence_id: str) -> PublishedSequence:
    """The published sequence, if a call is about it.

    Args:
        planning: the planning.
        sequence_id: identifier in the call; "" for whichever sequence is published.

    Raises:
        NodeError: UNKNOWN_SEQUENCE.
    """
    base = planning.published
    if base is None:
        text = "no sequence is published; plan one first"
    elif sequence_id not in ("", base.id):
        text = f"the published sequence is {base.id}"
    else:
        return base
    raise NodeError(NodeCode.UNKNOWN_SEQUENCE, text, "sequence_id", sequence_id)


def require_room(limit: int, what: str, count: int) -> None:
    """Refuse a call above the limit, since each one holds its own surfaces.

    Args:
        limit: value of the parameter `max_calls`.
        what: what is counted, in the plural.
        count: number of calls, this one included.

    Raises:
        NodeError: BUSY.
    """
    if count > limit:
        text = f"{limit} {what} wait already, as the parameter max_calls allows; call again later"
        raise NodeError(NodeCode.BUSY, text)
