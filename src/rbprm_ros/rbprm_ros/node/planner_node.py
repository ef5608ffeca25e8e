"""The planner's node: lifecycle, names, and callbacks that delegate."""

from __future__ import annotations

import sys
import threading
import uuid
from collections import Counter
from collections.abc import Awaitable, Callable
from typing import Any

from lifecycle_msgs.srv import ChangeState
from rbprm_msgs.action import PlanContacts
from rbprm_msgs.msg import ExecutionState, SurfaceArray
from rbprm_msgs.srv import GetEnvironment, ListRobots, Plan, Replan, SetEnvironment, Validate
from rclpy._rclpy_pybind11 import RCLError
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.exceptions import ParameterException
from rclpy.executors import Executor
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from visualization_msgs.msg import MarkerArray

from rbprm_core.errors import Cancelled, InvalidInput
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
    update_of_markers,
    update_of_message,
    update_of_setting,
)
from rbprm_ros.environment.store import Environment
from rbprm_ros.environment.update_queue import UpdateQueue
from rbprm_ros.environment.updates import SurfaceUpdate
from rbprm_ros.failure import NodeCode, NodeError
from rbprm_ros.node.parameters import Parameters
from rbprm_ros.node.plan_action import PlanAction
from rbprm_ros.node.progress_log import ProgressLog
from rbprm_ros.node.publishers import Outbox
from rbprm_ros.planning.planning import Planning
from rbprm_ros.planning.published import Published, Standing
from rbprm_ros.rclpy_utils.qos import CALLS
from rbprm_ros.rclpy_utils.spinning import Spinner, init
from rbprm_ros.rclpy_utils.subscription import EveryPublisher
from rbprm_ros.settings import Settings
from rbprm_ros.workers.jobs import Job, RobotChoice

VIEW_PERIOD = 0.5  # seconds between two looks whether the markers have changed
HEALTH_PERIOD = 1.0  # seconds between two diagnostics
ANSWER_TIMEOUT = 0.5  # seconds that calls under way have for their answer when the node stops
SENDING = 0.05  # seconds more; rclpy sends a goal's result in a task of its own, after it has ended
SUCCESS = TransitionCallbackReturn.SUCCESS


class PlannerNode(LifecycleNode):
    """Takes surfaces in, plans on request, publishes the plan and keeps it valid.

    All callbacks run in one thread and none of them plans: they await the planning processes, which
    live from `configure` to `cleanup`. While the node is not active, calls get NOT_ACTIVE.

    Raises:
        InvalidInput, ParameterException: a parameter that cannot be used.
    """

    def __init__(self) -> None:
        super().__init__("rbprm_planner")
        self._declared = Parameters(self)
        self._environment = Environment()
        self._updates = UpdateQueue(
            self._environment, self._settings, self._spinning, self._on_change
        )
        self._planning: Planning | None = None
        self._active = False
        self._calls: Counter[str] = Counter()  # not answered yet, by name of the service
        self._outbox = Outbox(self, self._settings)
        self._action = PlanAction(
            self, self._required, self._job_of_goal, self._outbox, self._require_room
        )
        self._inputs = (
            EveryPublisher(self, SurfaceArray, "~/surfaces", self._on_surfaces),
            EveryPublisher(self, MarkerArray, "~/surface_markers", self._on_markers),
        )
        self.create_subscription(ExecutionState, "~/execution_state", self._on_execution, CALLS)
        self._dirty = True  # something to see has changed
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(VIEW_PERIOD, self._on_view, clock=steady)
        self.create_timer(HEALTH_PERIOD, self._on_health, clock=steady)
        self._serve(Plan, "~/plan", self._on_plan)
        self._serve(Replan, "~/replan", self._on_replan)
        self._serve(Validate, "~/validate", self._on_validate)
        self._serve(GetEnvironment, "~/get_environment", self._on_get_environment)
        self._serve(SetEnvironment, "~/set_environment", self._on_set_environment)
        self._serve(ListRobots, "~/list_robots", self._on_list_robots)
        self._answer_every_transition()

    @property
    def calls(self) -> int:
        """Calls and goals not answered yet."""
        return self._calls.total() + self._action.goals

    def start(self) -> None:
        """Configure and activate, unless a manager is to do it."""
        if self._settings().autostart:
            self.trigger_configure()
            self.trigger_activate()
        frame = self._settings().planning_frame
        self.get_logger().info(f"up; frame {frame}")

    def close(self) -> None:
        """Stop planning and take back what is published; calls under way get the code CANCELLED."""
        self._end()

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Start the planning processes."""
        log = ProgressLog(self.get_logger(), self._settings().robot)
        self._planning = Planning(
            self._settings,
            lambda: self.get_clock().now().nanoseconds,
            self._environment,
            self._spinning,
            self._on_sequence,
            self._tell_standing,
            lambda reported: log(reported.progress),
        )
        self._planning.prepare(self.get_logger())
        self._tell_standing()
        return super().on_configure(state)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Serve calls."""
        self._active = True
        assert self._planning is not None
        self._planning.resume()
        return super().on_activate(state)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Stop all planning; the published sequence stays."""
        self._active = False
        if self._planning is not None:
            self._planning.cancel_all()
        return super().on_deactivate(state)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """End the processes and forget sequence and surfaces."""
        self._end()
        return super().on_cleanup(state)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """As cleanup, for good."""
        self._end()
        return super().on_shutdown(state)

    def _end(self) -> None:
        self._active = False
        if self._planning is not None:
            self._planning.close()
            self._planning = None
        self._updates.clear()
        self._dirty = True
        self._outbox.nothing()
        self._outbox.status(Standing(), None)

    def _answer_every_transition(self) -> None:
        """Refuse an impossible transition; rclpy raises there, and the caller waits for ever."""
        service = self._service_change_state
        change = service.callback

        def answer(message: ChangeState.Request, response: ChangeState.Response) -> Any:
            try:
                return change(message, response)
            except RCLError as error:
                self.get_logger().error(f"transition {message.transition.id} refused: {error}")
                response.success = False
                return response

        service.callback = answer

    def _settings(self) -> Settings:
        return self._declared.settings

    def _spinning(self) -> Executor:
        assert self.executor is not None  # it runs the callback that asks
        return self.executor

    def _required(self) -> Planning:
        """What plans, where the node is active."""
        if not self._active or self._planning is None:
            text = "the node is not active; `ros2 lifecycle set` configures and activates it"
            raise NodeError(NodeCode.NOT_ACTIVE, text)
        return self._planning

    def _require_room(self, what: str, count: int) -> None:
        """Refuse a call that would be one too many, itself counted: each holds what it came with.

        Raises:
            NodeError: BUSY.
        """
        most = self._settings().max_calls
        if count > most:
            text = f"{most} {what} wait already, as the parameter max_calls allows; ask again later"
            raise NodeError(NodeCode.BUSY, text)

    async def _take_all(self) -> None:
        """Take in what was published before the call that is to be served."""
        for topic in self._inputs:
            await topic.settled()
        await self._updates.settled()

    async def _job_of_goal(self, message: PlanContacts.Goal) -> Job:
        await self._take_all()
        return self._job(message)

    def _job(self, message: Plan.Request | PlanContacts.Goal) -> Job:
        return job_of_message(message, self._settings(), self._environment)

    def _on_view(self) -> None:
        if self._dirty:
            published = None if self._planning is None else self._planning.published
            plan = None if published is None else published.plan
            self._dirty = not self._outbox.markers(self._environment.snapshot, plan)

    def _on_health(self) -> None:
        planning, environment = self._planning, self._environment
        if planning is not None:
            self._outbox.health(planning, environment, self.calls)

    def _on_sequence(self, published: Published) -> None:
        self._outbox.sequence(published)
        self._dirty = True

    def _tell_standing(self) -> None:
        if self._planning is not None:
            self._outbox.status(self._planning.standing, self._planning.published)

    def _serve(self, kind: Any, name: str, serve: Callable[[Any, Any], Awaitable[None]]) -> None:
        """Offer a service that always answers; in the answer's `result` is what went wrong."""

        async def answer(message: Any, response: Any) -> Any:
            self._calls[name] += 1
            try:
                if hasattr(response, "result"):  # those that only tell something are soon over
                    self._require_room(f"calls of {name}", self._calls[name])
                await self._take_all()
                await serve(message, response)
            except Exception as error:
                refusal = self._outbox.refusal(error)
                if hasattr(response, "result"):
                    response.result = refusal
            finally:
                self._calls[name] -= 1
            return response

        self.create_service(
            kind,
            name,
            answer,
            qos_profile=CALLS,
            callback_group=ReentrantCallbackGroup(),  # a call waits while the next comes in
        )

    def _on_surfaces(self, message: SurfaceArray) -> None:
        self._take(lambda settings: update_of_message(message, settings), "surfaces")

    def _on_markers(self, message: MarkerArray) -> None:
        self._take(lambda settings: update_of_markers(message, settings), "surface markers")

    def _take(self, read: Callable[[Settings], SurfaceUpdate], what: str) -> None:
        """Take an update of the environment in; one with an error changes nothing."""
        refused = self._environment.rejection

        def refuse(error: Exception | None) -> None:
            if error is None or isinstance(error, Cancelled):
                return
            self._environment.rejection = str(error)
            if str(error) != refused:  # once, not 30 times a second
                self.get_logger().error(f"{what} refused, the old ones stay: {error}")

        try:
            update = read(self._settings())
        except InvalidInput as error:
            refuse(error)
        else:
            self._updates.add(update).add_done_callback(lambda done: refuse(done.exception()))

    def _on_change(self) -> None:
        """The environment is another one."""
        self._dirty = True
        version, count = self._environment.version, len(self._environment.snapshot.surfaces)
        self.get_logger().debug(f"surfaces {version}: {count}")
        if self._active and self._planning is not None:
            self._planning.surfaces_changed()

    def _on_execution(self, message: ExecutionState) -> None:
        if self._planning is not None:
            self._planning.executed(message.sequence_id, message.revision, message.state)

    async def _on_plan(self, message: Plan.Request, response: Plan.Response) -> None:
        planning, job = self._required(), self._job(message)
        log = ProgressLog(self.get_logger(), f"plan {job.id[:8]}")
        published = await planning.plan(job, lambda reported: log(reported.progress))
        self._outbox.answer(published, response)

    async def _on_replan(self, message: Replan.Request, response: Replan.Response) -> None:
        planning = self._required()
        base = self._base(planning, message.sequence_id)
        ask = message.from_state == -1 and not message.measured_state
        last = await planning.last_good(base) if ask else 0
        settings, environment = self._settings(), self._environment
        job = replan_job_of_message(message, base, last, settings, environment)
        if not job.measured and len(job.kept) <= planning.standing.executed:
            at = planning.standing.executed
            reason = f"the robot is in state {at} already; give that or a later one"
            raise InvalidInput("from_state", message.from_state, reason)
        self._outbox.answer(await planning.replan(job, base), response)

    def _base(self, planning: Planning, sequence_id: str) -> Published:
        """The published sequence, if it is the one that is meant."""
        base = planning.published
        if base is None:
            text = "no sequence is published; plan one first"
        elif sequence_id not in ("", base.id):
            text = f"the published sequence is {base.id}"
        else:
            return base
        raise NodeError(NodeCode.UNKNOWN_SEQUENCE, text, "sequence_id", sequence_id)

    async def _on_validate(self, message: Validate.Request, response: Validate.Response) -> None:
        planning = self._required()
        if message.sequence.states:
            base = planning.published
            own = base is not None and base.id == message.sequence.sequence_id
            known = (*known_robots(), self._settings().robot)
            name = one_of("sequence.robot", message.sequence.robot, known)
            robot = base.job.robot if own and base else RobotChoice(name)
            limbs = len(robot.description().limbs)
            plan = read_sequence(message.sequence, self._settings().max_states, limbs)
            found = planning.validate(robot, uuid.uuid4().hex, plan, message.from_state)
        else:
            base = self._base(planning, message.sequence.sequence_id)
            found = planning.validate_published(base, message.from_state)
        snapshot = self._environment.snapshot
        invalid = await found
        response.valid = not invalid
        response.invalid_states = invalid_state_messages(invalid)
        response.environment_version = snapshot.version
        response.surfaces_stamp = time_message(snapshot.stamp)
        response.result = result_message()

    async def _on_get_environment(
        self, message: GetEnvironment.Request, response: GetEnvironment.Response
    ) -> None:
        snapshot = self._environment.snapshot
        response.environment = environment_message(snapshot, self._outbox.header())
        response.environment_version = snapshot.version
        response.rejection = self._environment.rejection

    async def _on_set_environment(
        self, message: SetEnvironment.Request, response: SetEnvironment.Response
    ) -> None:
        update = update_of_setting(message, self._settings())
        try:
            await self._updates.add(update)
        except InvalidInput as error:
            field = "mesh" if message.mesh else f"environment.{error.field}"
            raise InvalidInput(field, error.value, error.reason) from error
        snapshot = self._environment.snapshot
        response.surfaces = len(snapshot.surfaces)
        response.obstacles = len(snapshot.obstacles)
        response.environment_version = snapshot.version
        response.result = result_message()

    async def _on_list_robots(
        self, message: ListRobots.Request, response: ListRobots.Response
    ) -> None:
        response.default_robot = self._settings().robot
        response.robots = robot_messages(response.default_robot)


def run(stop: threading.Event) -> int:
    """Serve until the event is set; returns the exit code, 2 where a parameter is wrong."""
    init()
    try:
        node = PlannerNode()
    except (InvalidInput, ParameterException) as error:
        print(f"planner_node: {error}", file=sys.stderr)
        return 2
    spinner = Spinner(node)
    node.start()
    spinner.spin_until(stop.is_set)
    node.close()
    spinner.spin_until(lambda: node.calls == 0, ANSWER_TIMEOUT)
    spinner.spin_until(lambda: False, SENDING)
    spinner.close()
    return 0
