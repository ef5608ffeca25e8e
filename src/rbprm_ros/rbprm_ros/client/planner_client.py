"""A client of the planner for mission executives: calls that wait, and the newest state.

The client uses a node of the caller. Another thread spins that node, or the client spins it while
it waits; see `PlannerClient`.
"""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Callable
from typing import Any

from rbprm_msgs.action import PlanContacts
from rbprm_msgs.msg import ContactSequence, ExecutionState, PlannerStatus
from rbprm_msgs.srv import GetEnvironment, ListRobots, Plan, Replan, Validate
from rclpy.action.client import ActionClient
from rclpy.node import Node
from rclpy.task import Future

from rbprm_ros.client.plan_call import PlanCall
from rbprm_ros.client.timing import ANSWER_TIMEOUT, PERIOD, PROBE_PERIOD
from rbprm_ros.rclpy_utils.qos import CALLS, LATCHED_STREAM

SpinUntil = Callable[[Callable[[], bool], float], Any]
"""Runs the node's callbacks until a condition holds or a timeout, in seconds, passes."""


class PlannerTimeout(TimeoutError):
    """The planner did not answer, or was not found, in time."""


class PlannerClient:
    """Calls the planner, and holds the newest sequence and status.

    To wait, the node must be spun. Either an executor spins it in another thread; then methods that
    wait must not be called in a callback. Or the caller gives a function that spins:

        spinner = Spinner(node)
        client = PlannerClient(node, spin_until=spinner.spin_until)

    Args:
        node: node of the caller.
        planner: name of the planner's node.
        spin_until: spins the node while this client waits; None where another thread does.

    Attributes:
        sequence: the newest published sequence; None before the first, and without states where the
            planner has none.
        status: the newest status; None before the first.
    """

    def __init__(
        self, node: Node, planner: str = "/rbprm_planner", spin_until: SpinUntil | None = None
    ) -> None:
        self.sequence: ContactSequence | None = None
        self.status: PlannerStatus | None = None
        self._node, self._planner, self._spin_until = node, planner, spin_until
        self._changed = threading.Condition()
        self._on_sequence: list[Callable[[ContactSequence], None]] = []
        self._on_status: list[Callable[[PlannerStatus], None]] = []
        self._action = ActionClient(node, PlanContacts, f"{planner}/plan_contacts")
        self._services = {
            kind: node.create_client(kind, f"{planner}/{name}", qos_profile=CALLS)
            for kind, name in (
                (Replan, "replan"),
                (Validate, "validate"),
                (GetEnvironment, "get_environment"),
                (ListRobots, "list_robots"),  # the last one: see `_reach`
            )
        }
        self._reached: set[tuple[int, ...]] = set()  # planners that have answered
        self._execution = node.create_publisher(ExecutionState, f"{planner}/execution_state", CALLS)
        # With a depth of 1, a status that is immediately followed by the next one would be lost.
        for kind, name, take in (
            (ContactSequence, "contact_sequence", self._take_sequence),
            (PlannerStatus, "status", self._take_status),
        ):
            node.create_subscription(kind, f"{planner}/{name}", take, LATCHED_STREAM)

    def watch(
        self,
        on_sequence: Callable[[ContactSequence], None] | None = None,
        on_status: Callable[[PlannerStatus], None] | None = None,
    ) -> None:
        """Add callbacks, which run in the executor's thread.

        Args:
            on_sequence: called with every sequence from now on.
            on_status: called with every status from now on.
        """
        self._on_sequence += [] if on_sequence is None else [on_sequence]
        self._on_status += [] if on_status is None else [on_status]

    @property
    def found(self) -> bool:
        """Whether all of the planner's interfaces are discovered.

        Those of a killed planner count as discovered until DDS drops them, by default after 20
        seconds.
        """
        services = all(service.service_is_ready() for service in self._services.values())
        subscribed = self._execution.get_subscription_count() > 0 and self.status is not None
        return services and subscribed and self._action.server_is_ready()

    def wait_for_planner(self, timeout: float) -> None:
        """Wait until the planner is found.

        Args:
            timeout: longest time to wait, seconds.

        Raises:
            PlannerTimeout: the planner was not found.
        """
        hint = f"planner {self._planner}; is it started, in this ROS domain and of this name?"
        self._reach(lambda: self.found, hint, timeout)

    def plan(
        self, goal: PlanContacts.Goal | Plan.Request, timeout: float = ANSWER_TIMEOUT
    ) -> PlanCall:
        """Send a goal, and return the call that represents it at once.

        Another goal under way, of this client or another, ends with the code PREEMPTED.

        Args:
            goal: what to plan.
            timeout: longest time to wait for a planner, seconds.

        Raises:
            PlannerTimeout: there is no planner.
        """
        if isinstance(goal, Plan.Request):
            fields = goal.get_fields_and_field_types()
            goal = PlanContacts.Goal(**{name: getattr(goal, name) for name in fields})
        what = f"action {self._planner}/plan_contacts"
        self._reach(self._action.server_is_ready, what, timeout)
        call = PlanCall(self)
        # Sent in the thread that receives answers: rclpy does not lock its table of sent goals.
        self.in_executor(
            lambda: self._action.send_goal_async(goal, call.on_feedback).add_done_callback(
                call.on_response
            )
        )
        return call

    def replan(self, request: Replan.Request, timeout: float) -> Replan.Response:
        """Replan the later part of the published sequence, and wait for the revision.

        Args:
            request: what to replan.
            timeout: longest time to wait, seconds.

        Raises:
            PlannerTimeout: no planner was found, or it did not answer.
        """
        return self._called(request, Replan, timeout)

    def validate(
        self, request: Validate.Request | None = None, timeout: float = ANSWER_TIMEOUT
    ) -> Validate.Response:
        """Validate a sequence on the newest surfaces.

        Args:
            request: what to validate; None for the published sequence.
            timeout: longest time to wait, seconds.

        Raises:
            PlannerTimeout: no planner was found, or it did not answer.
        """
        return self._called(request or Validate.Request(), Validate, timeout)

    def environment(self, timeout: float = ANSWER_TIMEOUT) -> GetEnvironment.Response:
        """The surfaces that the planner knows, and why it refused the newest message.

        Args:
            timeout: longest time to wait, seconds.

        Raises:
            PlannerTimeout: no planner was found, or it did not answer.
        """
        return self._called(GetEnvironment.Request(), GetEnvironment, timeout)

    def executed(self, sequence: ContactSequence, state: int) -> None:
        """Publish the state that the robot is in or moves to.

        Args:
            sequence: the executed sequence.
            state: index of the state.
        """
        message = ExecutionState(
            sequence_id=sequence.sequence_id, revision=sequence.revision, state=state
        )
        message.header.stamp = self._node.get_clock().now().to_msg()
        self._execution.publish(message)

    def wait_until(self, done: Callable[[], bool], what: str, timeout: float) -> None:
        """Wait until a condition holds, while callbacks run.

        Args:
            done: the condition.
            what: name of what is waited for, for the error.
            timeout: longest time to wait, seconds.

        Raises:
            PlannerTimeout: the condition does not hold.
        """
        if self._spin_until is not None:
            self._spin_until(done, timeout)
        else:
            end = time.monotonic() + timeout
            while not done() and time.monotonic() < end:
                with self._changed:
                    self._changed.wait(min(PERIOD, max(end - time.monotonic(), 0.0)))
        if not done():
            raise PlannerTimeout(self._late(what, timeout))

    def answer(self, future: Future, what: str, timeout: float) -> Any:
        """Wait for the result of a future and return it.

        Args:
            future: future of a call.
            what: name of what is waited for, for the error.
            timeout: longest time to wait, seconds.

        Raises:
            PlannerTimeout: the future is not done.
        """
        future.add_done_callback(lambda _: self.wake())
        self.wait_until(future.done, what, timeout)
        return future.result()

    def in_executor(self, make: Callable[[], Any]) -> Any:
        """Call a function in the thread that runs the callbacks, and return its result.

        Args:
            make: the function.
        """
        executor = self._node.executor
        if self._spin_until is not None or executor is None:
            return make()
        task = executor.create_task(make)
        self.answer(task, "executor's turn", ANSWER_TIMEOUT)
        return task.result()

    def wake(self) -> None:
        """Let all waiting methods check their conditions."""
        with self._changed:
            self._changed.notify_all()

    def _called(self, request: Any, kind: Any, timeout: float) -> Any:
        service, end = self._services[kind], time.monotonic() + timeout
        what = f"service {service.srv_name}"
        self._reach(service.service_is_ready, what, timeout)
        future = service.call_async(request)
        try:
            left = max(end - time.monotonic(), 0.0)
            return self.answer(future, f"answer of {service.srv_name}", left)
        finally:
            service.remove_pending_request(future)

    def _reach(self, ready: Callable[[], bool], what: str, timeout: float) -> None:
        """Wait until a server is ready and its answers reach this client.

        A server that is ready for the client may not have discovered the client's reader of
        answers, and the answer to a first call would be lost. DDS announces the readers of a
        participant in the order of their creation, and that of `list_robots` was made after those
        of the other services and the action. An answer to this read-only call, which is repeated
        until then, shows that the planner has discovered all of them.

        Args:
            ready: returns whether the server is ready.
            what: name of the server, for the error.
            timeout: seconds.

        Raises:
            PlannerTimeout: the server is not ready, or does not answer.
        """
        end = time.monotonic() + timeout
        self.wait_until(ready, what, timeout)
        planners = self._planners()
        if planners and planners <= self._reached:
            return
        probe = self._services[ListRobots]
        calls: list[Future] = []
        try:
            while not any(call.done() for call in calls):
                left = end - time.monotonic()
                if left <= 0:
                    raise PlannerTimeout(self._late(what, timeout))
                calls.append(probe.call_async(ListRobots.Request()))
                calls[-1].add_done_callback(lambda _: self.wake())
                with contextlib.suppress(PlannerTimeout):
                    self.wait_until(
                        lambda: any(call.done() for call in calls), what, min(PROBE_PERIOD, left)
                    )
        finally:
            for call in calls:
                probe.remove_pending_request(call)
        self._reached |= planners

    def _planners(self) -> set[tuple[int, ...]]:
        """Return the DDS identifiers of the planners of this name: of their status publishers."""
        found = self._node.get_publishers_info_by_topic(f"{self._planner}/status")
        return {tuple(info.endpoint_gid) for info in found}

    def _late(self, what: str, timeout: float) -> str:
        text = f"no {what} within {timeout:g} s"
        if self._spin_until is None and self._node.executor is None:
            text += "; no executor has the node: spin it in another thread, or give spin_until"
        return text

    def _take_sequence(self, message: ContactSequence) -> None:
        self.sequence = message
        for callback in self._on_sequence:
            callback(message)
        self.wake()

    def _take_status(self, message: PlannerStatus) -> None:
        self.status = message
        for callback in self._on_status:
            callback(message)
        self.wake()
