"""The planner's node: lifecycle, and the parts that it consists of."""

from __future__ import annotations

import sys
import threading
from typing import Any

from lifecycle_msgs.srv import ChangeState
from rbprm_msgs.action import PlanContacts
from rbprm_msgs.msg import ExecutionState
from rclpy._rclpy_pybind11 import RCLError
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.exceptions import ParameterException
from rclpy.executors import Executor
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn

from rbprm_core.errors import InvalidInput
from rbprm_ros.conversions import job_of_message
from rbprm_ros.errors import NodeCode, NodeError
from rbprm_ros.node.environment_inputs import EnvironmentInputs
from rbprm_ros.node.parameters import Parameters
from rbprm_ros.node.plan_action import PlanAction
from rbprm_ros.node.progress_log import ProgressLog
from rbprm_ros.node.publishers import Publishers
from rbprm_ros.node.services import Services
from rbprm_ros.planning.planning import Planning
from rbprm_ros.planning.sequence import PublishedSequence
from rbprm_ros.planning.status import PlannerStatus
from rbprm_ros.rclpy_utils.qos import CALLS
from rbprm_ros.rclpy_utils.spinning import Spinner, init
from rbprm_ros.settings import Settings
from rbprm_ros.workers.jobs import Job

MARKERS_PERIOD = 0.5  # seconds between two checks whether the markers have changed
DIAGNOSTICS_PERIOD = 1.0  # seconds between two diagnostics
ANSWER_TIMEOUT = 0.5  # seconds for the answers to calls under way when the node stops
SENDING_TIME = 0.05  # seconds after that: rclpy sends a goal's result in a task of its own


class PlannerNode(LifecycleNode):
    """Receives surfaces, plans on request, publishes the plan and keeps it valid.

    All callbacks run in one thread and none of them plans: they await the worker processes, which
    exist from `configure` to `cleanup`. While the node is not active, calls get NOT_ACTIVE.

    Raises:
        InvalidInput, ParameterException: a parameter that cannot be used.
    """

    def __init__(self) -> None:
        super().__init__("rbprm_planner")
        self._declared = Parameters(self)
        self._planning: Planning | None = None
        self._active = False
        self._markers_outdated = True
        self._inputs = EnvironmentInputs(
            self, self._settings, self._running_executor, self._on_change
        )
        self._outputs = Publishers(self, self._settings)
        self._action = PlanAction(
            self, self._settings, self._required_planning, self._job_of_goal, self._outputs
        )
        self._offered = Services(
            self, self._settings, self._required_planning, self._inputs, self._outputs
        )
        self.create_subscription(ExecutionState, "~/execution_state", self._on_execution, CALLS)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(MARKERS_PERIOD, self._publish_markers, clock=steady)
        self.create_timer(DIAGNOSTICS_PERIOD, self._publish_diagnostics, clock=steady)
        self._answer_every_transition()

    @property
    def calls(self) -> int:
        """Number of calls and goals without an answer yet."""
        return self._offered.calls + self._action.goals

    def start(self) -> None:
        """Configure and activate the node, unless a lifecycle manager is to do it."""
        if self._settings().autostart:
            self.trigger_configure()
            self.trigger_activate()
        frame = self._settings().planning_frame
        self.get_logger().info(f"up; frame {frame}")

    def close(self) -> None:
        """Stop planning and withdraw what is published; calls under way get the code CANCELLED."""
        self._end()

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Start the worker processes.

        Args:
            state: lifecycle state before the transition.
        """
        log = ProgressLog(self.get_logger(), self._settings().robot)
        self._planning = Planning(
            self._settings,
            lambda: self.get_clock().now().nanoseconds,
            self._inputs.environment,
            self._running_executor,
            self._on_sequence,
            self._publish_status,
            lambda reported: log(reported.progress),
        )
        self._planning.prepare(self.get_logger())
        self._publish_status()
        return super().on_configure(state)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Serve calls.

        Args:
            state: lifecycle state before the transition.
        """
        self._active = True
        assert self._planning is not None
        self._planning.activate()
        return super().on_activate(state)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Cancel all planning; the published sequence stays.

        Args:
            state: lifecycle state before the transition.
        """
        self._active = False
        if self._planning is not None:
            self._planning.deactivate()
        return super().on_deactivate(state)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """End the worker processes, and remove sequence and surfaces.

        Args:
            state: lifecycle state before the transition.
        """
        self._end()
        return super().on_cleanup(state)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """End the worker processes, and remove sequence and surfaces, for good.

        Args:
            state: lifecycle state before the transition.
        """
        self._end()
        return super().on_shutdown(state)

    def _end(self) -> None:
        self._active = False
        if self._planning is not None:
            self._planning.close()
            self._planning = None
        self._inputs.clear()
        self._markers_outdated = True
        self._outputs.withdraw_sequence()
        self._outputs.status(PlannerStatus(), None)

    def _answer_every_transition(self) -> None:
        """Refuse impossible transitions; rclpy raises there, and the caller would wait forever."""
        service = self._service_change_state
        change = service.callback

        def answer(request: ChangeState.Request, response: ChangeState.Response) -> Any:
            try:
                return change(request, response)
            except RCLError as error:
                self.get_logger().error(f"transition {request.transition.id} refused: {error}")
                response.success = False
                return response

        service.callback = answer

    def _settings(self) -> Settings:
        return self._declared.settings

    def _running_executor(self) -> Executor:
        assert self.executor is not None  # it runs the callback from which this is called
        return self.executor

    def _required_planning(self) -> Planning:
        """The planning.

        Raises:
            NodeError: NOT_ACTIVE.
        """
        if not self._active or self._planning is None:
            text = "the node is not active; `ros2 lifecycle set` configures and activates it"
            raise NodeError(NodeCode.NOT_ACTIVE, text)
        return self._planning

    async def _job_of_goal(self, goal: PlanContacts.Goal) -> Job:
        await self._inputs.settled()
        return job_of_message(goal, self._settings(), self._inputs.environment)

    def _on_change(self) -> None:
        """The environment has changed."""
        self._markers_outdated = True
        environment = self._inputs.environment
        count = len(environment.snapshot.surfaces)
        self.get_logger().debug(f"surfaces {environment.version}: {count}")
        if self._active and self._planning is not None:
            self._planning.monitor.surfaces_changed()

    def _on_execution(self, message: ExecutionState) -> None:
        if self._planning is not None:
            tracker = self._planning.tracker
            tracker.record_execution(message.sequence_id, message.revision, message.state)

    def _on_sequence(self, sequence: PublishedSequence) -> None:
        self._outputs.sequence(sequence)
        self._markers_outdated = True

    def _publish_status(self) -> None:
        if self._planning is not None:
            self._outputs.status(self._planning.tracker.status, self._planning.published)

    def _publish_markers(self) -> None:
        if self._markers_outdated:
            published = None if self._planning is None else self._planning.published
            plan = None if published is None else published.plan
            snapshot = self._inputs.environment.snapshot
            self._markers_outdated = not self._outputs.markers(snapshot, plan)

    def _publish_diagnostics(self) -> None:
        if self._planning is not None:
            self._outputs.diagnostics(self._planning, self._inputs.environment, self.calls)


def run(stop: threading.Event) -> int:
    """Run the node until an event is set; returns the exit code, 2 for a wrong parameter.

    Args:
        stop: the event.
    """
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
    spinner.spin_until(lambda: False, SENDING_TIME)
    spinner.close()
    return 0
