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
from rbprm_ros.node.publishers import Outbox
from rbprm_ros.planning.planning import Planning
from rbprm_ros.workers.jobs import Job, Reported, Result

RESULT_KEPT = 60  # seconds that a result can still be asked for; rclpy's 900 are a lot of plans


class PlanAction:
    """Serves goals, one at a time.

    Args:
        planning: gives what plans; raises where the node is not active.
        job: makes the work that a goal asks for.
        require_room: raises where there are too many, given what is counted and how many there are.
    """

    def __init__(
        self,
        node: Node,
        planning: Callable[[], Planning],
        job: Callable[[PlanContacts.Goal], Awaitable[Job]],
        outbox: Outbox,
        require_room: Callable[[str, int], None],
    ) -> None:
        self._planning, self._job, self._outbox = planning, job, outbox
        self._require_room = require_room
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
            result_timeout=RESULT_KEPT,
        )

    @property
    def goals(self) -> int:
        """Goals not ended yet."""
        return len(self._goals)

    def _accept(self, handle: ServerGoalHandle) -> None:
        """A goal came: the one before makes room for it, unless it is one too many."""
        goal = self._goals[_key(handle)] = _Goal(handle)
        try:
            self._require_room("goals", len(self._goals))
        except NodeError as error:
            goal.refusal = error
        else:
            before, self._current = self._current, goal
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


def _key(handle: ServerGoalHandle) -> bytes:
    """Identity of a goal; handles themselves are no keys."""
    return bytes(handle.goal_id.uuid)


class _Goal:
    """A goal under way."""

    def __init__(self, handle: ServerGoalHandle) -> None:
        self.handle, self.preempted, self.cancelled = handle, False, False
        self.refusal: NodeError | None = None
        self.work: WorkFuture[Result] | None = None
        self.planning: Planning | None = None
