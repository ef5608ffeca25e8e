"""What the node does between its interfaces: plans, validates, and plans again by itself.

Everything runs in the executor's thread, as coroutines that await the two processes: one plans, the
other tells which states of the published sequence still hold, so that it never waits for a plan.
"""

from __future__ import annotations

import dataclasses
import uuid
from collections.abc import Callable
from concurrent.futures import CancelledError
from concurrent.futures import Future as WorkFuture
from dataclasses import replace

from rclpy.executors import Executor
from rclpy.impl.rcutils_logger import RcutilsLogger

from rbprm_core.errors import Cancelled, ErrorCode, RbprmError
from rbprm_core.plan import ContactPlan, StateEntry
from rbprm_core.replanning import InvalidState, Keep, Replan, Situation, Stuck, decide
from rbprm_ros.awaiting import outcome_of
from rbprm_ros.bounds import derived_bounds
from rbprm_ros.environment import Environment
from rbprm_ros.failure import SUCCEEDED, Failure, NodeCode, NodeError, failure_of
from rbprm_ros.jobs import Job, Result, RobotChoice, Validation
from rbprm_ros.parameters import Settings
from rbprm_ros.published import Activity, Published, Standing
from rbprm_ros.worker import PlanningWorker, Report

Submitted = Callable[[WorkFuture[Result]], None]


def ignore(_: object) -> None:
    """Told something that nobody wants to know."""


class Planning:
    """The planner's work and the published sequence.

    Args:
        settings: gives the parameters of now. now: tells nanoseconds of the ROS clock.
        executor: gives the one that runs the callbacks.
        on_published: told every new revision. on_standing: told every change.
        log: told what a person might want to read.
    """

    def __init__(
        self,
        settings: Callable[[], Settings],
        now: Callable[[], int],
        environment: Environment,
        executor: Callable[[], Executor],
        on_published: Callable[[Published], None],
        on_standing: Callable[[], None],
        log: Report,
    ) -> None:
        self._settings, self._environment, self._executor = settings, environment, executor
        self._now = now
        self._on_published, self._on_standing = on_published, on_standing
        robot = RobotChoice(settings().robot)
        self.planner = PlanningWorker(robot, log)
        self.watcher = PlanningWorker(robot, ignore, "watching")
        self.published: Published | None = None
        self.standing = Standing()
        self._told: tuple[Published | None, Standing] = None, self.standing
        self._works: set[WorkFuture[Result]] = set()  # plans that callers wait for
        self._watching = self._stale = False
        self._halted = True
        self._replanning: WorkFuture[Result] | None = None
        self._restarts = 0
        self._lost = False  # whether the newest look has to be taken again in a new process

    def prepare(self, log: RcutilsLogger) -> None:
        """Have both processes up and the default robot's data at hand."""

        def told(work: WorkFuture[Result]) -> None:
            error = work.exception() if not work.cancelled() else None
            if error is None:
                log.info("the planning process is ready")
            else:
                log.error(f"the planning process is not ready: {error}")

        self.planner.prepare().add_done_callback(told)
        self.watcher.prepare()

    def close(self) -> None:
        """End both processes; what they do ends as cancelled."""
        self._halted = True
        self.planner.close()
        self.watcher.close()

    async def plan(
        self, job: Job, report: Report = ignore, submitted: Submitted = ignore
    ) -> Published:
        """Plan a new sequence and publish it.

        Args:
            submitted: given the work, by which it can be cancelled.

        Raises:
            RbprmError: why there is none.
        """
        plan = await self._planned(job, report, submitted)
        assert job.snapshot is not None
        published = Published(job.id, 0, 0, plan, job, self._now(), job.snapshot.stamp)
        self._publish(published, executed=-1)
        return published

    async def replan(self, job: Job, base: Published, submitted: Submitted = ignore) -> Published:
        """Plan the later part of the published sequence anew and publish the revision.

        Raises:
            RbprmError: why there is none; OUTDATED where another revision came first.
        """
        plan = await self._planned(job, ignore, submitted)
        text = self._outdated(job, base)
        if text:
            self._stand(activity=self._resting(self.standing.invalid))
            raise NodeError(NodeCode.OUTDATED, text)
        return self._publish_revision(job, base, plan)

    def _outdated(self, job: Job, base: Published) -> str:
        """Why a revision is for nothing; "" where it is not."""
        if self.published is not base:
            return f"sequence {base.id} has another revision now; ask again"
        if not job.measured and len(job.kept) <= self.standing.executed:
            return f"the robot went on to state {self.standing.executed} meanwhile; ask again"
        return ""

    async def validate(
        self, robot: RobotChoice, key: str, plan: ContactPlan, first: int
    ) -> tuple[InvalidState, ...]:
        """The states of a sequence, from one on, that do not hold on the surfaces of now."""
        work = self._validation(robot, key, plan, first)
        found = await outcome_of(self.watcher.submit(work, ignore), self._executor())
        assert isinstance(found, tuple)
        return found

    async def last_good(self, base: Published) -> int:
        """Index of the state from which on the published sequence is best planned anew.

        The last that holds before one that does not; where all hold, the executed one.
        """
        executed = max(self.standing.executed, 0)
        invalid = await self.validate(base.job.robot, base.key, base.plan, executed)
        first = min((state.index for state in invalid), default=executed + 1)
        return max(first - 1, executed)

    def cancel(self, work: WorkFuture[Result]) -> None:
        """Stop a plan."""
        self.planner.cancel(work)

    def cancel_all(self) -> None:
        """Stop all plans, asked for or begun here, and begin none before `resume`."""
        self._halted = True
        begun = () if self._replanning is None else (self._replanning,)
        for work in (*self._works, *begun):
            self.planner.cancel(work)

    def resume(self) -> None:
        """Keep the published sequence valid from now on."""
        self._halted = False
        self.surfaces_changed()  # they may have, while nobody looked

    def executed(self, sequence_id: str, state: int) -> None:
        """Take note of where the robot is; of another sequence than the published one, nothing."""
        if self.published is not None and sequence_id == self.published.id:
            state = min(state, len(self.published.plan.states) - 1)
            self._stand(executed=max(state, self.standing.executed))

    def surfaces_changed(self) -> None:
        """Look at the published sequence; outdated work is cancelled, a burst is one look."""
        self._stale = True
        options = self._settings().replanning
        if self._replanning is not None:
            begun = self._replanning.running()  # one that waits for a caller's plan loses nothing
            if not begun or self._restarts < options.most_restarts:
                self._restarts += begun  # under changes without pause it has to come to an end, too
                self.planner.cancel(self._replanning)
        if not self._watching:
            self._watching = True
            self._executor().create_task(self._watch)

    async def _planned(self, job: Job, report: Report, submitted: Submitted) -> ContactPlan:
        """A plan that a caller waits for."""
        if self._replanning is not None:  # who asks does not wait for what was begun here
            self._stale = True
            self.planner.cancel(self._replanning)
        work = self.planner.submit(job, report)
        self._works.add(work)
        submitted(work)
        self._stand(activity=Activity.PLANNING, failure=SUCCEEDED)
        try:
            plan = await outcome_of(work, self._executor())
        except CancelledError as error:  # before it began
            self._works.discard(work)
            self._stand(activity=self._resting(self.standing.invalid))
            raise Cancelled("waiting") from error
        except RbprmError as error:
            self._works.discard(work)
            failure = failure_of(error)
            if self._works or failure.code == ErrorCode.CANCELLED:  # by a newer goal, mostly
                self._stand(activity=self._resting(self.standing.invalid))
            else:
                self._stand(activity=Activity.FAILED, failure=failure)
            raise
        finally:
            self._works.discard(work)
        assert isinstance(plan, ContactPlan)
        return plan

    def _publish(self, published: Published, executed: int) -> None:
        if self._replanning is not None:  # of a revision that nobody needs any more
            self.planner.cancel(self._replanning)
        self.published = published
        self._on_published(published)
        activity = self._resting(())
        self._stand(activity=activity, invalid=(), executed=executed, failure=SUCCEEDED)
        snapshot = published.job.snapshot
        if snapshot is None or snapshot.version != self._environment.snapshot.version:
            self.surfaces_changed()
        else:  # so that it knows the states, and that they were free, when a change comes
            job, plan = published.job, published.plan
            self.watcher.submit(self._validation(job.robot, published.key, plan, 0), ignore)

    def _publish_revision(self, job: Job, base: Published, plan: ContactPlan) -> Published:
        assert job.snapshot is not None
        first = 0 if job.measured else len(job.kept)
        published = Published(
            base.id, base.revision + 1, first, plan, job, self._now(), job.snapshot.stamp
        )
        self._publish(published, executed=0 if job.measured else self.standing.executed)
        return published

    async def _watch(self) -> None:
        """Look until what was looked at is the newest."""
        try:
            while self._stale:
                self._stale = False
                await self._look()
        finally:
            self._watching = False

    async def _look(self) -> None:
        """Validate what lies ahead, tell it, and plan what does not hold anew."""
        base = self.published
        if base is None:
            return
        ahead = max(self.standing.executed, 0)
        try:
            invalid = await self.validate(base.job.robot, base.key, base.plan, ahead)
        except RbprmError as error:
            failure = failure_of(error)
            self._lost = failure.code == NodeCode.WORKER_LOST and not self._lost
            if self._lost:  # once more: what kills one process may kill them all
                self._stale = True
            elif self.published is base:
                self._stand(activity=Activity.FAILED, failure=failure)
            return
        self._lost = False
        if self.published is not base:
            self._stale = True
            return
        indices = tuple(state.index for state in invalid)
        situation = Situation(len(base.plan.states), self.standing.executed, indices, base.complete)
        decision = decide(situation)
        if isinstance(decision, Keep):
            self._restarts = 0
            self._stand(activity=self._resting(()), invalid=(), failure=SUCCEEDED)
            return
        self._stand(activity=Activity.INVALIDATED, invalid=invalid)
        if isinstance(decision, Stuck):
            failure = Failure(ErrorCode.START_UNREACHABLE, decision.reason)
            self._stand(activity=Activity.FAILED, failure=failure)
        elif self._settings().replanning.automatic and not self._halted:
            await self._mend(base, decision)

    async def _mend(self, base: Published, decision: Replan) -> None:
        """Plan anew from the first state from which it works; publish what holds if none does."""
        limit = self._settings().replanning.time_limit / len(decision.candidates)
        failure = SUCCEEDED
        for candidate in decision.candidates:
            job = self.resumed(base, base.plan.states[: candidate + 1], limit)
            self._stand(activity=Activity.REPLANNING)
            self._replanning = self.planner.submit(job, ignore)
            try:
                plan = await outcome_of(self._replanning, self._executor())
            except (CancelledError, RbprmError) as error:
                if self._halted:
                    self._stand(activity=Activity.INVALIDATED)
                    return
                if self._stale or self.published is not base:
                    self._stale = True  # the surfaces changed again, or another plan came
                    return
                failure = failure_of(error)
                continue
            finally:
                self._replanning = None
            self._restarts = 0
            if self.published is base and self.standing.executed <= candidate:
                assert isinstance(plan, ContactPlan)
                self._publish_revision(job, base, plan)
            else:  # what was planned anew is over already, or of another sequence
                self._stale = True
            return
        self._restarts = 0
        self._cut(base, max(decision.candidates) + 1, failure)

    def _cut(self, base: Published, count: int, failure: Failure) -> None:
        """Publish the states that hold, without those after them."""
        if count < len(base.plan.states):
            plan = base.plan.model_copy(update={"states": base.plan.states[:count]})
            base = replace(
                base, revision=base.revision + 1, first_changed=count, plan=plan,
                stamp=self._now(), complete=False,
            )  # fmt: skip
            self.published = base
            self._on_published(base)
        self._stand(activity=Activity.FAILED, invalid=(), failure=failure)

    def resumed(self, base: Published, kept: tuple[StateEntry, ...], time_limit: float) -> Job:
        """The work that goes on from the last of some states to the sequence's own goal."""
        snapshot, job = self._environment.snapshot, base.job
        request = job.request
        if job.bounds_derived:
            rule = self._settings().bounds
            bounds = derived_bounds(request.start, request.goal, snapshot.surfaces, rule)
            request = dataclasses.replace(request, bounds=bounds)
        return Job(
            uuid.uuid4().hex, job.robot, request, time_limit, snapshot, kept,
            bounds_derived=job.bounds_derived,
        )  # fmt: skip

    def _validation(
        self, robot: RobotChoice, key: str, plan: ContactPlan, first: int
    ) -> Validation:
        request = plan.request
        return Validation(
            uuid.uuid4().hex, robot, key, plan.states, request.robustness_threshold,
            request.gravity, first, self._environment.snapshot,
        )  # fmt: skip

    def _resting(self, invalid: tuple[InvalidState, ...]) -> Activity:
        """What is so while no caller's plan is the news; given the states that do not hold."""
        if self._works:
            return Activity.PLANNING
        if self.published is None:
            return Activity.IDLE
        if invalid:
            return Activity.INVALIDATED if self._replanning is None else Activity.REPLANNING
        return Activity.VALID if self.published.complete else Activity.FAILED

    def _stand(self, **changes: object) -> None:
        self.standing = replace(self.standing, **changes)  # type: ignore[arg-type]
        if self._told != (self.published, self.standing):
            self._told = self.published, self.standing
            self._on_standing()
