"""The action ~/plan_contacts: feedback, cancel, a newer goal in the place of the one under way."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from concurrent.futures import Future as WorkFuture
from dataclasses import replace

from rbprm_msgs.action import PlanContacts
from rclpy.action.server import ActionServer, CancelResponse, ServerGoalHandle
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node

from rbprm_core.errors import Cancelled, ErrorCode
from rbprm_ros.failure import NodeCode, NodeError, PlanningFailed
from rbprm_ros.jobs import Job, Reported, Result
from rbprm_ros.outbox import Outbox
from rbprm_ros.planning import Planning

RESULT_KEPT = 60  # seconds that a result can still be asked for; rclpy's 900 are a lot of plans


class PlanAction:
    """Serves goals, one at a time.

    Args:
        planning: gives what plans; raises where the node is not active.
        job: makes the work that a goal asks for.
    """

    def __init__(
        self,
        node: Node,
        planning: Callable[[], Planning],
        job: Callable[[PlanContacts.Goal], Awaitable[Job]],
        outbox: Outbox,
    ) -> None:
        self._planning, self._job, self._outbox = planning, job, outbox
        self._current: _Goal | None = None
        self.goals = 0
        """Goals not ended yet."""
        self._server = ActionServer(
            node,
            PlanContacts,
            "~/plan_contacts",
            execute_callback=self._execute,
            handle_accepted_callback=self._accept,
            cancel_callback=self._cancel,
            callback_group=ReentrantCallbackGroup(),
            result_timeout=RESULT_KEPT,
        )

    def _accept(self, handle: ServerGoalHandle) -> None:
        """A goal came: the one before makes room for it."""
        self.goals += 1
        before, self._current = self._current, _Goal(handle)
        if before is not None:
            before.preempted = True
            self._stop(before)
        handle.execute()

    def _cancel(self, handle: ServerGoalHandle) -> CancelResponse:
        goal = self._current
        if goal is not None and goal.handle.goal_id == handle.goal_id:
            goal.cancelled = True
            self._stop(goal)
        return CancelResponse.ACCEPT

    def _stop(self, goal: _Goal) -> None:
        if goal.work is not None and goal.planning is not None:
            goal.planning.cancel(goal.work)

    async def _execute(self, handle: ServerGoalHandle) -> PlanContacts.Result:
        goal = self._current
        if goal is None or goal.handle is not handle:  # a newer one came before this began
            goal = _Goal(handle, preempted=True)
        try:
            return await self._planned(goal)
        except Exception as error:
            return self._failed(goal, error)
        finally:
            self.goals -= 1
            if self._current is goal:
                self._current = None

    async def _planned(self, goal: _Goal) -> PlanContacts.Result:
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
                self._outbox.partial(job, reported.states)

        def submitted(work: WorkFuture[Result]) -> None:
            goal.work, goal.planning = work, planning
            if goal.preempted or goal.cancelled:
                planning.cancel(work)

        published = await planning.plan(job, report, submitted)
        result = PlanContacts.Result()
        self._outbox.answer(published, result)
        if goal.handle.is_cancel_requested:  # too late: the plan is out
            goal.handle.canceled()
        else:
            goal.handle.succeed()
        return result

    def _failed(self, goal: _Goal, error: Exception) -> PlanContacts.Result:
        partial = error.partial if isinstance(error, PlanningFailed) else None
        if goal.preempted:
            text = "a newer goal took its place"
            error = NodeError(NodeCode.PREEMPTED, text)
        elif goal.cancelled and not isinstance(error, PlanningFailed):
            error = Cancelled("waiting")
        result = PlanContacts.Result(result=self._outbox.refusal(error))
        if partial is not None:
            self._outbox.answer_partly(partial, result)
        if result.result.code == ErrorCode.CANCELLED and goal.handle.is_cancel_requested:
            goal.handle.canceled()
        else:
            goal.handle.abort()
        return result


class _Goal:
    """A goal under way."""

    def __init__(self, handle: ServerGoalHandle, preempted: bool = False) -> None:
        self.handle, self.preempted, self.cancelled = handle, preempted, False
        self.work: WorkFuture[Result] | None = None
        self.planning: Planning | None = None
