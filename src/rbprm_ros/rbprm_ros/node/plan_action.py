"""The action ~/plan_contacts: feedback, cancellation, and preemption by a newer goal."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from concurrent.futures import Future as WorkFuture
from dataclasses import replace

from rbprm_msgs.action import PlanContacts
from rclpy.action.server import ActionServer, CancelResponse, ServerGoalHandle
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node

from rbprm_core.errors import Cancelled, ErrorCode
from rbprm_ros.errors import NodeCode, NodeError, PlanningFailed
from rbprm_ros.node.publishers import Publishers
from rbprm_ros.node.services import require_room
from rbprm_ros.planning.planning import Planning
from rbprm_ros.settings import Settings
from rbprm_ros.workers.jobs import Job, Reported, Result

RESULT_TIMEOUT = 60  # seconds that a result can be fetched; rclpy's 900 s would hold many plans


class PlanAction:
    """Serves goals, one at a time.

    Args:
        node: the planner's node.
        settings: returns the current parameters.
        planning: returns the planning; raises NOT_ACTIVE while the node is not active.
        job: returns the work of a goal.
        publishers: the node's publishers, which make the messages of plans too.
    """

    def __init__(
        self,
        node: Node,
        settings: Callable[[], Settings],
        planning: Callable[[], Planning],
        job: Callable[[PlanContacts.Goal], Awaitable[Job]],
        publishers: Publishers,
    ) -> None:
        self._settings, self._planning, self._job = settings, planning, job
        self._publishers = publishers
        self._goals: dict[bytes, _Goal] = {}  # not ended yet
        self._current: _Goal | None = None
        self._server = ActionServer(
            node,
            PlanContacts,
            "~/plan_contacts",
            execute_callback=self._execute,
            handle_accepted_callback=self._accept,
            cancel_callback=self._cancel,
            callback_group=ReentrantCallbackGroup(),
            result_timeout=RESULT_TIMEOUT,
        )

    @property
    def goals(self) -> int:
        """Number of goals that have not ended yet."""
        return len(self._goals)

    def _accept(self, handle: ServerGoalHandle) -> None:
        """Accept a goal, which preempts the one before, unless there are too many."""
        goal = self._goals[_key(handle)] = _Goal(handle)
        try:
            require_room(self._settings().max_calls, "goals", len(self._goals))
        except NodeError as error:
            goal.refusal = error
        else:
            before, self._current = self._current, goal
            if before is not None:
                before.preempted = True
                before.stop()
        handle.execute()

    def _cancel(self, handle: ServerGoalHandle) -> CancelResponse:
        goal = self._current
        if goal is not None and goal.handle.goal_id == handle.goal_id:
            goal.cancelled = True
            goal.stop()
        return CancelResponse.ACCEPT

    async def _execute(self, handle: ServerGoalHandle) -> PlanContacts.Result:
        goal = self._goals[_key(handle)]
        try:
            if goal.refusal is not None:
                raise goal.refusal
            return await self._planned(goal)
        except Exception as error:
            return self._failed(goal, error)
        finally:
            del self._goals[_key(handle)]
            if self._current is goal:
                self._current = None

    async def _planned(self, goal: _Goal) -> PlanContacts.Result:
        """The result of a goal whose planning succeeds.

        Raises:
            RbprmError: planning failed.
        """
        planning = self._planning()
        job = replace(await self._job(goal.handle.request), shown=True)

        def report(reported: Reported) -> None:  # in the worker's thread
            progress = reported.progress
            feedback = PlanContacts.Feedback(
                stage=progress.stage,
                fraction=progress.fraction,
                states=progress.states,
                time=progress.elapsed,
            )
            goal.handle.publish_feedback(feedback)
            if reported.states is not None:
                self._publishers.partial(job, reported.states)

        def submitted(work: WorkFuture[Result]) -> None:
            goal.work, goal.planning = work, planning
            if goal.preempted or goal.cancelled:
                goal.stop()

        sequence = await planning.calls.plan(job, report, submitted)
        result = PlanContacts.Result()
        self._publishers.answer(sequence, result)
        if goal.handle.is_cancel_requested:  # too late: the plan is published
            goal.handle.canceled()
        else:
            goal.handle.succeed()
        return result

    def _failed(self, goal: _Goal, error: Exception) -> PlanContacts.Result:
        """The result of a goal whose planning failed."""
        partial = error.partial if isinstance(error, PlanningFailed) else None
        if goal.preempted:
            error = NodeError(NodeCode.PREEMPTED, "a newer goal took its place")
        elif goal.cancelled and not isinstance(error, PlanningFailed):
            error = Cancelled("waiting")
        result = PlanContacts.Result(result=self._publishers.refusal(error))
        if partial is not None:
            self._publishers.answer_partly(partial, result)
        if result.result.code == ErrorCode.CANCELLED and goal.handle.is_cancel_requested:
            goal.handle.canceled()
        else:
            goal.handle.abort()
        return result


def _key(handle: ServerGoalHandle) -> bytes:
    """Identifier of a goal; handles cannot be keys themselves."""
    return bytes(handle.goal_id.uuid)


class _Goal:
    """A goal that has not ended yet.

    Attributes:
        handle: rclpy's handle of the goal.
        preempted: whether a newer goal took its place.
        cancelled: whether the client cancelled it.
        refusal: why it is not planned at all; None where it is planned.
        work: its work; None before that is submitted.
        planning: the planning that does the work.
    """

    def __init__(self, handle: ServerGoalHandle) -> None:
        self.handle, self.preempted, self.cancelled = handle, False, False
        self.refusal: NodeError | None = None
        self.work: WorkFuture[Result] | None = None
        self.planning: Planning | None = None

    def stop(self) -> None:
        """Cancel the work, if it is submitted."""
        if self.work is not None and self.planning is not None:
            self.planning.calls.cancel(self.work)
