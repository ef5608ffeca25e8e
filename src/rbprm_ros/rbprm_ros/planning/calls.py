"""Plans and replans for callers."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import CancelledError
from concurrent.futures import Future as WorkFuture

from rclpy.executors import Executor

from rbprm_core.errors import Cancelled, ErrorCode
from rbprm_core.plan_record import ContactPlan
from rbprm_ros.errors import NO_ERROR, ErrorData, NodeCode, NodeError, error_data
from rbprm_ros.planning.monitor import SequenceMonitor
from rbprm_ros.planning.sequence import PublishedSequence
from rbprm_ros.planning.status_tracker import StatusTracker
from rbprm_ros.planning.validator import Validator, ignore
from rbprm_ros.rclpy_utils.awaiting import outcome_of
from rbprm_ros.workers.jobs import Job, Result
from rbprm_ros.workers.worker import PlanningWorker, Report

WAITING = "waiting"  # stage of a call that is cancelled before it is planned or published
Submitted = Callable[[WorkFuture[Result]], None]


class PlanningCalls:
    """Serves calls for plans, one after the other.

    Args:
        now: returns the ROS time, nanoseconds.
        executor: returns the executor that runs the callbacks.
        planner: process that plans.
        validator: validates in another process.
        tracker: holds the published sequence and the status.
        monitor: publishes the plans and monitors them.
    """

    def __init__(
        self,
        now: Callable[[], int],
        executor: Callable[[], Executor],
        planner: PlanningWorker,
        validator: Validator,
        tracker: StatusTracker,
        monitor: SequenceMonitor,
    ) -> None:
        self._now, self._executor = now, executor
        self._planner, self._validator = planner, validator
        self._tracker, self._monitor = tracker, monitor
        self._works: set[WorkFuture[Result]] = set()  # of calls that have not ended

    async def plan(
        self, job: Job, report: Report = ignore, submitted: Submitted = ignore
    ) -> PublishedSequence:
        """Plan a new sequence, publish it and return it.

        Args:
            job: what to plan.
            report: called with the progress, in another thread.
            submitted: called with the work, by which it can be cancelled.

        Raises:
            RbprmError: planning failed.
        """
        plan = await self._planned(job, report, submitted)
        assert job.snapshot is not None
        stamps = (self._now(), job.snapshot.stamp)
        sequence = PublishedSequence(job.id, 0, 0, plan, job, *stamps)
        self._monitor.publish(sequence, executed=-1, planning=bool(self._works))
        return sequence

    async def replan(
        self, job: Job, base: PublishedSequence, submitted: Submitted = ignore
    ) -> PublishedSequence:
        """Replan the later part of the published sequence, publish the revision and return it.

        Args:
            job: what to plan.
            base: the published sequence.
            submitted: called with the work, by which it can be cancelled.

        Raises:
            RbprmError: planning failed; OUTDATED where another revision was published first.
        """
        plan = await self._planned(job, ignore, submitted)
        text = self._tracker.why_outdated(job, base, plan.states)
        if text:
            self._tracker.end_call(bool(self._works))
            raise NodeError(NodeCode.OUTDATED, text)
        return self._monitor.publish_revision(job, base, plan, planning=bool(self._works))

    async def last_valid_state(self, base: PublishedSequence) -> int:
        """Index of the state from which the published sequence is best replanned.

        It is the last state before the first invalid one; where all are valid, the executed one.

        Args:
            base: the published sequence.

        Raises:
            RbprmError: the validating process was lost.
        """
        executed = max(self._tracker.executed, 0)
        invalid = await self._validator.validate_published(base, executed)
        first = min((state.index for state in invalid), default=executed + 1)
        return max(first - 1, executed)

    def cancel(self, work: WorkFuture[Result]) -> None:
        """Cancel a call's work.

        Args:
            work: future of the work.
        """
        self._planner.cancel(work)

    def cancel_all(self) -> None:
        """Cancel the work of all calls."""
        for work in tuple(self._works):
            self._planner.cancel(work)

    async def _planned(self, job: Job, report: Report, submitted: Submitted) -> ContactPlan:
        """The plan of a call.

        Raises:
            RbprmError: planning failed; `Cancelled` where the node was deactivated meanwhile.
        """
        if not self._tracker.active:  # since the call came
            raise Cancelled(WAITING)
        self._monitor.yield_to_call()
        work = self._planner.submit(job, report)
        self._works.add(work)
        submitted(work)
        self._tracker.begin_call()
        try:
            plan = await outcome_of(work, self._executor())
            if not self._tracker.active:  # the node was deactivated as the plan came
                raise Cancelled(WAITING)
        except CancelledError as error:  # before it began
            self._end(work, NO_ERROR)
            raise Cancelled(WAITING) from error
        except Exception as error:
            self._end(work, error_data(error))
            raise
        self._works.discard(work)
        assert isinstance(plan, ContactPlan)
        return plan

    def _end(self, work: WorkFuture[Result], error: ErrorData) -> None:
        """Update the status after a call without a plan.

        The error is in the status unless another call is under way, the node is not active, or a
        newer goal cancelled this one.
        """
        self._works.discard(work)
        cancelled = error.code == ErrorCode.CANCELLED
        if self._works or not self._tracker.active or cancelled:
            error = NO_ERROR
        self._tracker.end_call(bool(self._works), error)
