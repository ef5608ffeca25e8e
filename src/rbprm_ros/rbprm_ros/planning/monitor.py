"""Monitoring of the published sequence: validation when surfaces change, and replanning."""

from __future__ import annotations

import dataclasses
import uuid
from collections.abc import Callable
from concurrent.futures import CancelledError
from concurrent.futures import Future as WorkFuture

from rclpy.executors import Executor

from rbprm_core.errors import ErrorCode, RbprmError
from rbprm_core.guide.root_bounds import derived_bounds
from rbprm_core.plan_record import ContactPlan
from rbprm_core.replanning import (
    InvalidState,
    Keep,
    Replan,
    Situation,
    Stuck,
    decide,
    root_placement,
)
from rbprm_ros.environment.snapshot import Snapshot
from rbprm_ros.environment.store import Environment
from rbprm_ros.errors import ErrorData, NodeCode, error_data
from rbprm_ros.planning.sequence import PublishedSequence
from rbprm_ros.planning.status import Validity
from rbprm_ros.planning.status_tracker import StatusTracker
from rbprm_ros.planning.validator import Validator, ignore
from rbprm_ros.rclpy_utils.awaiting import outcome_of
from rbprm_ros.settings import Settings
from rbprm_ros.workers.jobs import Job, Result
from rbprm_ros.workers.worker import PlanningWorker


class SequenceMonitor:
    """Publishes sequences, validates the published one, and replans its invalid part.

    Everything runs in the executor's thread, as coroutines that await the worker processes.

    Args:
        settings: returns the current parameters.
        now: returns the ROS time, nanoseconds.
        environment: the environment.
        executor: returns the executor that runs the callbacks.
        planner: process that replans.
        validator: validates in another process.
        tracker: holds the published sequence and the status.
        on_published: called with every new revision.
    """

    def __init__(
        self,
        settings: Callable[[], Settings],
        now: Callable[[], int],
        environment: Environment,
        executor: Callable[[], Executor],
        planner: PlanningWorker,
        validator: Validator,
        tracker: StatusTracker,
        on_published: Callable[[PublishedSequence], None],
    ) -> None:
        self._settings, self._now = settings, now
        self._environment, self._executor = environment, executor
        self._planner, self._validator, self._tracker = planner, validator, tracker
        self._on_published = on_published
        self._running = False  # whether the coroutine below exists
        self._stale = False  # whether sequence or surfaces changed since the last validation began
        self._replanning: WorkFuture[Result] | None = None
        self._restarts = 0  # times in a row that newer surfaces ended validation or replanning
        self._retrying = False  # whether the last validation lost its process and is repeated

    def publish(
        self,
        sequence: PublishedSequence,
        executed: int,
        validity: Validity = Validity.PLANNED,
        planning: bool | None = None,
    ) -> None:
        """Publish a sequence and monitor it from now on.

        Args:
            sequence: the sequence.
            executed: index of the state that the robot is in; -1 where it is unknown.
            validity: `PLANNED` or `REPLANNED`.
            planning: whether calls wait or are served; None leaves that as it was.
        """
        self.cancel_replanning()  # of the sequence before
        self._on_published(sequence)
        self._tracker.publish(sequence, validity, executed, planning)
        assert sequence.job.snapshot is not None
        if self._stale or sequence.job.snapshot.version != self._environment.version:
            self.surfaces_changed()
        else:
            self._tracker.record_validation(Validity.VALID)
            self._validator.prepare(sequence)

    def publish_revision(
        self,
        job: Job,
        base: PublishedSequence,
        plan: ContactPlan,
        validity: Validity = Validity.PLANNED,
        planning: bool | None = None,
    ) -> PublishedSequence:
        """Publish the result of replanning as the next revision and return it.

        Args:
            job: replanning work.
            base: sequence that was replanned.
            plan: the result.
            validity: see `publish`.
            planning: see `publish`.
        """
        sequence = base.revised(job, plan, self._now())
        executed = 0 if job.measured else self._tracker.executed
        self.publish(sequence, executed, validity, planning)
        return sequence

    def cancel_replanning(self) -> None:
        """Cancel automatic replanning, if it waits or is under way."""
        if self._replanning is not None:
            self._planner.cancel(self._replanning)

    def yield_to_call(self) -> None:
        """Cancel automatic replanning for a caller's plan; it begins again after that."""
        if self._replanning is not None:
            self._stale = True
            self.cancel_replanning()

    def surfaces_changed(self) -> None:
        """Validate the published sequence; changes in quick succession are validated together."""
        self._stale = True
        if self._replanning is not None:
            waits = not self._replanning.running()  # for a caller's plan, so that no work is lost
            if waits or self._may_restart():
                self.cancel_replanning()
        if not self._running:
            self._running = True
            self._executor().create_task(self._run)

    def _may_restart(self) -> bool:
        """Whether newer surfaces may end what is under way once more.

        Where surfaces change without pause, replanning has to come to an end too.
        """
        if self._restarts >= self._settings().replanning.max_restarts:
            return False
        self._restarts += 1
        return True

    async def _run(self) -> None:
        """Validate until the validated sequence and surfaces are the newest ones."""
        try:
            while self._stale:
                self._stale = False
                await self._validate()
        except Exception as error:
            self._tracker.record_validation(Validity.FAILED, error=error_data(error))
            raise
        finally:
            self._running = False

    async def _validate(self) -> None:
        """Validate the states that are not executed yet, and replan where some are invalid."""
        base = self._tracker.published
        if base is None:
            return
        first, snapshot = max(self._tracker.executed, 0), self._environment.snapshot
        try:
            invalid = await self._validator.validate_published(base, first)
        except RbprmError as error:
            self._handle_failed_validation(base, error_data(error))
            return
        self._retrying = False
        if self._tracker.published is not base:
            self._stale = True
        elif not (self._stale and self._may_restart()):
            await self._respond(base, snapshot, invalid)

    def _handle_failed_validation(self, base: PublishedSequence, error: ErrorData) -> None:
        """Repeat a validation whose process was lost, once; else the status is FAILED.

        A sequence that ended one process may end every process.
        """
        self._retrying = error.code == NodeCode.WORKER_LOST and not self._retrying
        if self._retrying:
            self._stale = True
        elif self._tracker.published is base:
            self._tracker.record_validation(Validity.FAILED, error=error)

    async def _respond(
        self, base: PublishedSequence, snapshot: Snapshot, invalid: tuple[InvalidState, ...]
    ) -> None:
        """Update the status after a validation, and replan where that is necessary."""
        indices = tuple(state.index for state in invalid)
        states, executed = len(base.plan.states), self._tracker.executed
        decision = decide(Situation(states, executed, indices, base.complete))
        if isinstance(decision, Keep):
            self._restarts = 0
            self._tracker.record_validation(Validity.VALID, (), snapshot)
            return
        if invalid:
            self._tracker.record_validation(Validity.INVALID, invalid, snapshot)
        else:  # the sequence ends before its goal, and the way there may be open again
            self._tracker.record_valid_states(snapshot)
        if isinstance(decision, Stuck):
            error = ErrorData(
                ErrorCode.START_UNREACHABLE, decision.reason, cause=decision.failure.cause
            )
            self._tracker.record_validation(Validity.FAILED, error=error)
        elif self._settings().replanning.automatic and self._tracker.active:
            await self._replan(base, decision)

    async def _replan(self, base: PublishedSequence, decision: Replan) -> None:
        """Replan from the first state from which it succeeds; else publish the valid states."""
        job = self._replan_job(base, decision.candidates)
        self._replanning = self._planner.submit(job, ignore)
        self._tracker.begin_replanning()
        plan: Result = None
        failed: CancelledError | RbprmError | None = None
        try:
            plan = await outcome_of(self._replanning, self._executor())
        except (CancelledError, RbprmError) as error:
            failed = error
        finally:
            self._replanning = None
            self._tracker.end_replanning()
        if failed is not None:
            self._handle_failed_replanning(base, job, failed)
            return
        self._restarts = 0
        assert isinstance(plan, ContactPlan)
        if not self._tracker.active:
            return
        if self._tracker.why_outdated(job, base, plan.states):
            self._stale = True
        else:
            self.publish_revision(job, base, plan, Validity.REPLANNED)

    def _handle_failed_replanning(
        self, base: PublishedSequence, job: Job, error: CancelledError | RbprmError
    ) -> None:
        """Publish the valid states, unless there is a reason to validate again."""
        if not self._tracker.active:
            return
        changed = self._stale or self._tracker.published is not base
        robot_moved_on = len(job.kept) <= self._tracker.executed  # to an invalid state
        if changed or robot_moved_on:
            self._stale = True
        else:
            self._restarts = 0
            self._shorten(base, len(job.kept), error_data(error))

    def _shorten(self, base: PublishedSequence, count: int, error: ErrorData) -> None:
        """Publish the first states of a sequence, which are valid, without those after them."""
        if count < len(base.plan.states):
            shortened = base.shortened(count, self._now())
            self._on_published(shortened)
            self._tracker.published = shortened
        self._tracker.record_validation(Validity.FAILED, (), error=error)

    def _replan_job(self, base: PublishedSequence, candidates: tuple[int, ...]) -> Job:
        """Work that plans from one of some states to the sequence's own goal."""
        snapshot, job, settings = self._environment.snapshot, base.job, self._settings()
        request = job.request
        kept = base.plan.states[: max(candidates) + 1]
        if job.bounds_derived:
            roots = [root_placement(kept[k]) for k in candidates]
            places = [request.start, request.goal, *roots]  # where surfaces are lost, too
            bounds = derived_bounds(places, snapshot.surfaces, settings.bounds)
            request = dataclasses.replace(request, bounds=bounds)
        return Job(
            uuid.uuid4().hex,
            job.robot,
            request,
            settings.replanning.time_limit,
            snapshot,
            kept,
            candidates,
            bounds_derived=job.bounds_derived,
            keep_roadmaps=settings.keep_roadmaps,
        )
