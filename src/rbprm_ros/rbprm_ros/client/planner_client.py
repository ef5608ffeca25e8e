"""A client of the planner for mission executives: calls that wait, and state that is watched.

It belongs to a node of the caller's. That node spins in another thread, or the client spins it
while it waits; see `PlannerClient`.
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
from rclpy.action.client import ActionClient, ClientGoalHandle
from rclpy.node import Node
from rclpy.task import Future

from rbprm_ros.rclpy_utils.qos import CALLS, LATCHED_STREAM

PERIOD = 0.05  # seconds between looks for what no callback tells, such as a service that is there
PROBE_PERIOD = 1.0  # seconds until a probe without an answer is sent again
ANSWER_TIMEOUT = 10.0  # seconds; a call that plans nothing is answered in milliseconds

SpinUntil = Callable[[Callable[[], bool], float], Any]
"""Serves the node's callbacks until a condition holds, or for so many seconds."""


class PlannerTimeout(TimeoutError):
    """The planner did not do something in time."""


class PlanCall:
    """A goal of the action, from `PlannerClient.plan`.

    Attributes:
        feedback: the newest, None before the first.
    """

    def __init__(self, client: PlannerClient) -> None:
        self.feedback: PlanContacts.Feedback | None = None
        self._client = client
        self._handle: ClientGoalHandle | None = None
        self._answer: PlanContacts.Result | None = None
        self._error: Exception | None = None

    @property
    def done(self) -> bool:
        """Whether the result is there."""
        return self._answer is not None or self._error is not None

    def result(self, timeout: float) -> PlanContacts.Result:
        """Wait for the result; its `result.code` says whether there is a plan.

        Args:
            timeout: seconds. Give more than the goal's own time limit.

        Raises:
            PlannerTimeout: the goal goes on; wait again, or cancel it.
            RuntimeError: the node refused the goal, or the call failed.
        """
        self._client.wait_until(lambda: self.done, "result of the goal", timeout)
        if self._error is not None:
            raise RuntimeError(f"the goal has no result: {self._error}") from self._error
        return self._answer

    def cancel(self, timeout: float = ANSWER_TIMEOUT) -> bool:
        """Ask the planner to stop; the result comes with the code CANCELLED.

        Returns:
            False where it was too late: the goal had ended.

        Raises:
            PlannerTimeout: the planner did not answer.
        """
        client = self._client
        client.wait_until(lambda: self._handle is not None or self.done, "accepted goal", timeout)
        handle = self._handle
        if handle is None or self.done:
            return False
        request = client.in_executor(handle.cancel_goal_async)
        return bool(client.answer(request, "answer to the cancellation", timeout).goals_canceling)

    def _fed(self, message: Any) -> None:
        self.feedback = message.feedback

    def _accepted(self, future: Future) -> None:
        """The planner took the goal, or did not; runs in the executor's thread."""
        handle = future.result()
        if not handle.accepted:
            self._error = RuntimeError("the planner refused it; is it shutting down?")
        else:
            self._handle = handle
            handle.get_result_async().add_done_callback(self._ended)
        self._client.wake()

    def _ended(self, future: Future) -> None:
        self._error = future.exception()
        if self._error is None:
            self._answer = future.result().result
        self._client.wake()


class PlannerClient:
    """What an executive asks of the planner, and what the planner tells.

    Waits need somebody who spins the node. Either an executor spins it in another thread, then no
    method that waits may be called in a callback. Or the caller gives a function that spins:

        spinner = Spinner(node)
        client = PlannerClient(node, spin_until=spinner.spin_until)

    Args:
        node: of the caller's. planner: name of the planner's node.
        spin_until: spins the node while this client waits; None where another thread does.

    Attributes:
        sequence: the newest published sequence, None before the first; without states where the
            planner has none.
        status: the newest status, None before the first.
    """

    def __init__(
        self, node: Node, planner: str = "/rbprm_planner", spin_until: SpinUntil | None = None
    ) -> None:
        self.sequence: ContactSequence | None = None
        self.status: PlannerStatus | None = None
        self._node, self._planner, self._spin_until = node, planner, spin_until
        self._news = threading.Condition()
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
        # A reader of depth 1 would lose a status that is followed by the next one at once.
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
        """Be told every sequence and status from now on, in the executor's thread."""
        self._on_sequence += [] if on_sequence is None else [on_sequence]
        self._on_status += [] if on_status is None else [on_status]

    @property
    def found(self) -> bool:
        """Whether the planner's interfaces are all there.

        One that was killed counts as there until DDS gives it up, by default after 20 seconds.
        """
        services = all(service.service_is_ready() for service in self._services.values())
        heard = self._execution.get_subscription_count() > 0 and self.status is not None
        return services and heard and self._action.server_is_ready()

    def wait_for_planner(self, timeout: float) -> None:
        """Wait until the planner is found.

        Raises:
            PlannerTimeout: it is not.
        """
        hint = f"planner {self._planner}; is it started, in this ROS domain and of this name?"
        self._reach(lambda: self.found, hint, timeout)

    def plan(
        self, goal: PlanContacts.Goal | Plan.Request, timeout: float = ANSWER_TIMEOUT
    ) -> PlanCall:
        """Ask for a plan; returns at once what tells how it goes.

        A goal that is under way, of this client or another, ends with the code PREEMPTED.

        Args:
            goal: what to plan. timeout: seconds to wait for a planner.

        Raises:
            PlannerTimeout: there is no planner.
        """
        if isinstance(goal, Plan.Request):
            fields = goal.get_fields_and_field_types()
            goal = PlanContacts.Goal(**{name: getattr(goal, name) for name in fields})
        what = f"action {self._planner}/plan_contacts"
        self._reach(self._action.server_is_ready, what, timeout)
        call = PlanCall(self)
        # Registered where answers come in: rclpy takes no lock over the table of sent goals.
        self.in_executor(
            lambda: self._action.send_goal_async(goal, call._fed).add_done_callback(call._accepted)
        )
        return call

    def replan(self, request: Replan.Request, timeout: float) -> Replan.Response:
        """Plan the later part of the published sequence anew and wait for the revision.

        Raises:
            PlannerTimeout: no planner, or no answer.
        """
        return self._called(request, Replan, timeout)

    def validate(
        self, request: Validate.Request | None = None, timeout: float = ANSWER_TIMEOUT
    ) -> Validate.Response:
        """Ask which states of a sequence hold today; by default of the published one.

        Raises:
            PlannerTimeout: no planner, or no answer.
        """
        return self._called(request or Validate.Request(), Validate, timeout)

    def environment(self, timeout: float = ANSWER_TIMEOUT) -> GetEnvironment.Response:
        """Ask which surfaces the planner knows, and why it refused the newest message.

        Raises:
            PlannerTimeout: no planner, or no answer.
        """
        return self._called(GetEnvironment.Request(), GetEnvironment, timeout)

    def executed(self, sequence: ContactSequence, state: int) -> None:
        """Tell the planner which state the robot is in, or moves to."""
        message = ExecutionState(
            sequence_id=sequence.sequence_id, revision=sequence.revision, state=state
        )
        message.header.stamp = self._node.get_clock().now().to_msg()
        self._execution.publish(message)

    def wait_until(self, done: Callable[[], bool], what: str, timeout: float) -> None:
        """Wait, while callbacks are served.

        Args:
            what: is waited for, for the error. timeout: seconds.

        Raises:
            PlannerTimeout: it did not come.
        """
        if self._spin_until is not None:
            self._spin_until(done, timeout)
        else:
            end = time.monotonic() + timeout
            while not done() and time.monotonic() < end:
                with self._news:
                    self._news.wait(min(PERIOD, max(end - time.monotonic(), 0.0)))
        if not done():
            raise PlannerTimeout(self._late(what, timeout))

    def answer(self, future: Future, what: str, timeout: float) -> Any:
        """Wait for the outcome of a call to ROS.

        Raises:
            PlannerTimeout: it did not come.
        """
        future.add_done_callback(lambda _: self.wake())
        self.wait_until(future.done, what, timeout)
        return future.result()

    def in_executor(self, make: Callable[[], Any]) -> Any:
        """Do something in the thread that serves the callbacks."""
        executor = self._node.executor
        if self._spin_until is not None or executor is None:
            return make()
        task = executor.create_task(make)
        self.answer(task, "executor's turn", ANSWER_TIMEOUT)
        return task.result()

    def wake(self) -> None:
        """Have those who wait look again."""
        with self._news:
            self._news.notify_all()

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
        for told in self._on_sequence:
            told(message)
        self.wake()

    def _take_status(self, message: PlannerStatus) -> None:
        self.status = message
        for told in self._on_status:
            told(message)
        self.wake()
