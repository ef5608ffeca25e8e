"""What the node does between its interfaces: plans, validates, and plans again by itself.

Everything runs in the executor's thread, as coroutines that await the two processes: one plans, the
other tells which states of the published sequence still hold, so that it never waits for a plan.
"""

from __future__ import annotations

import dataclasses
import itertools
import uuid
from collections.abc import Callable, Sequence
from concurrent.futures import CancelledError
from concurrent.futures import Future as WorkFuture
from dataclasses import dataclass, replace
from typing import Any

from rclpy.executors import Executor
from rclpy.impl.rcutils_logger import RcutilsLogger

from rbprm_core.errors import Cancelled, ErrorCode, RbprmError
from rbprm_core.guide.root_bounds import derived_bounds
from rbprm_core.plan_record import ContactPlan, StateEntry
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
from rbprm_ros.failure import SUCCEEDED, Failure, NodeCode, NodeError, failure_of
from rbprm_ros.planning.published import Activity, Published, Standing
from rbprm_ros.rclpy_utils.awaiting import outcome_of
from rbprm_ros.settings import Settings
from rbprm_ros.workers.jobs import Job, Result, RobotChoice, Validation
from rbprm_ros.workers.worker import PlanningWorker, Report

CLOSED = "waiting"  # where the node stopped before a plan was asked for, or before it was out
Submitted = Callable[[WorkFuture[Result]], None]


@dataclass(frozen=True)
class _Verdict:
    """What was found of the published sequence last, and why it cannot be mended if so."""

    activity: Activity
    failure: Failure


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
        self._verdict: _Verdict | None = None  # None until the published sequence was looked at
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
        text = self._outdated(job, base, plan)
        if text:
            self._rest()
            raise NodeError(NodeCode.OUTDATED, text)
        return self._publish_revision(job, base, plan)

    def _outdated(self, job: Job, base: Published, plan: ContactPlan) -> str:
        """Why a revision is for nothing; "" where it is not."""
        if self.published is not base:
            return f"sequence {base.id} has another revision now; ask again"
        if not job.measured and _common(job.kept, plan.states) <= self.standing.executed:
            return f"the robot went on to state {self.standing.executed} meanwhile; ask again"
        return ""

    async def validate(
        self, robot: RobotChoice, key: str, plan: ContactPlan, first: int
    ) -> tuple[InvalidState, ...]:
        """The states of a sequence, from one on, that do not hold on the surfaces of now."""
        least = plan.request.robustness_threshold
        return await self._looked(self._validation(robot, key, plan, least, first))

    async def validate_published(self, base: Published, first: int) -> tuple[InvalidState, ...]:
        """The same of the published sequence, whose states may be less robust where asked for."""
        return await self._looked(self._validation_of(base, first))

    async def _looked(self, work: Validation) -> tuple[InvalidState, ...]:
        found = await outcome_of(self.watcher.submit(work, ignore), self._executor())
        assert isinstance(found, tuple)
        return found

    async def last_good(self, base: Published) -> int:
        """Index of the state from which on the published sequence is best planned anew.

        The last that holds before one that does not; where all hold, the executed one.
        """
        executed = max(self.standing.executed, 0)
        invalid = await self.validate_published(base, executed)
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
        self._rest()

    def resume(self) -> None:
        """Keep the published sequence valid from now on."""
        self._halted = False
        if self._environment.version != self.standing.environment_version:
            self._verdict = None  # nobody has held it against these surfaces
        self._rest()
        self.surfaces_changed()  # they may have, while nobody looked

    def executed(self, sequence_id: str, revision: int, state: int) -> None:
        """Take note of where the robot is; of another sequence than the published one, nothing.

        Of the revision before, what the published one has of it: it may have been under way.
        """
        base = self.published
        if base is None or sequence_id != base.id:
            return
        if revision == base.revision:
            most = len(base.plan.states) - 1
        elif revision == base.revision - 1:
            most = base.first_changed - 1
        else:
            return
        self._stand(executed=max(min(state, most), self.standing.executed))

    def surfaces_changed(self) -> None:
        """Look at the published sequence; outdated work is cancelled, a burst is one look."""
        self._stale = True
        if self._replanning is not None:
            waits = not self._replanning.running()  # for a caller's plan: nothing is lost
            if waits or self._begin_anew():
                self.planner.cancel(self._replanning)
        if not self._watching:
            self._watching = True
            self._executor().create_task(self._watch)

    def _begin_anew(self) -> bool:
        """Whether newer surfaces may outdate what is under way once more.

        Under changes without pause something has to come to an end, too.
        """
        if self._restarts >= self._settings().replanning.max_restarts:
            return False
        self._restarts += 1
        return True

    async def _planned(self, job: Job, report: Report, submitted: Submitted) -> ContactPlan:
        """A plan that a caller waits for."""
        if self._halted:  # since the call came
            raise Cancelled(CLOSED)
        if self._replanning is not None:  # who asks does not wait for what was begun here
            self._stale = True
            self.planner.cancel(self._replanning)
        work = self.planner.submit(job, report)
        self._works.add(work)
        submitted(work)
        self._stand(activity=Activity.PLANNING, failure=SUCCEEDED)
        try:
            plan = await outcome_of(work, self._executor())
            if self._halted:  # it came as the node was stopped, and nothing is published any more
                raise Cancelled(CLOSED)
        except CancelledError as error:  # before it began
            self._works.discard(work)
            self._rest()
            raise Cancelled(CLOSED) from error
        except Exception as error:
            self._works.discard(work)
            self._told_failure(failure_of(error))
            raise
        self._works.discard(work)
        assert isinstance(plan, ContactPlan)
        return plan

    def _told_failure(self, failure: Failure) -> None:
        """Tell that a caller's plan failed; what is published stands as it did."""
        if self._works or self._halted or failure.code == ErrorCode.CANCELLED:  # by a newer goal
            self._rest()
        elif self.published is None:
            self._stand(activity=Activity.FAILED, failure=failure)
        else:
            self._rest(failure)

    def _publish(self, published: Published, executed: int) -> None:
        if self._replanning is not None:  # of a revision that nobody needs any more
            self.planner.cancel(self._replanning)
        self.published, self._verdict = published, None
        self._on_published(published)
        snapshot = published.job.snapshot
        assert snapshot is not None
        self._stand(invalid=(), executed=executed, failure=SUCCEEDED, **_seen(snapshot))
        if self._stale or snapshot.version != self._environment.version:
            self.surfaces_changed()  # nobody says that it holds before it was held against them
        else:
            self._judge(Activity.VALID)
            # So that it knows the states, and that they were free, when a change comes.
            self.watcher.submit(self._validation_of(published, 0), ignore)

    def _publish_revision(self, job: Job, base: Published, plan: ContactPlan) -> Published:
        assert job.snapshot is not None
        first = 0 if job.measured else _common(job.kept, plan.states)
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
        except Exception as error:
            self._judge(Activity.FAILED, failure_of(error))
            raise
        finally:
            self._watching = False

    async def _look(self) -> None:
        """Validate what lies ahead, tell it, and plan what does not hold anew."""
        base = self.published
        if base is None:
            return
        ahead, snapshot = max(self.standing.executed, 0), self._environment.snapshot
        try:
            invalid = await self.validate_published(base, ahead)
        except RbprmError as error:
            failure = failure_of(error)
            self._lost = failure.code == NodeCode.WORKER_LOST and not self._lost
            if self._lost:  # once more: what kills one process may kill them all
                self._stale = True
            elif self.published is base:
                self._judge(Activity.FAILED, failure)
            return
        self._lost = False
        if self.published is not base:
            self._stale = True
            return
        if self._stale and self._begin_anew():
            return  # what was looked at is not the newest any more
        indices = tuple(state.index for state in invalid)
        situation = Situation(len(base.plan.states), self.standing.executed, indices, base.complete)
        decision = decide(situation)
        if isinstance(decision, Keep):
            self._restarts = 0
            self._judge(Activity.VALID, invalid=(), **_seen(snapshot))
            return
        if invalid:
            self._judge(Activity.INVALIDATED, invalid=invalid, **_seen(snapshot))
        else:  # the rest is missing, and the way to it may be open again
            self._stand(invalid=(), **_seen(snapshot))
        if isinstance(decision, Stuck):
            failure = Failure(ErrorCode.START_UNREACHABLE, decision.reason)
            self._judge(Activity.FAILED, failure)
        elif self._settings().replanning.automatic and not self._halted:
            await self._mend(base, decision)

    async def _mend(self, base: Published, decision: Replan) -> None:
        """Plan anew from the first state from which it works; publish what holds if none does."""
        job = self._resumed(base, decision.candidates)
        self._replanning = self.planner.submit(job, ignore)
        self._stand(activity=Activity.REPLANNING)
        try:
            plan = await outcome_of(self._replanning, self._executor())
        except (CancelledError, RbprmError) as error:
            failed: CancelledError | RbprmError | None = error
        else:
            failed = None
        finally:
            self._replanning = None
        if failed is not None:
            self._not_mended(base, job, failed)
            return
        self._restarts = 0
        assert isinstance(plan, ContactPlan)
        if self._halted:
            self._rest()
        elif self._outdated(job, base, plan):  # over already, or of another sequence
            self._stale = True
        else:
            self._publish_revision(job, base, plan)

    def _not_mended(self, base: Published, job: Job, error: CancelledError | RbprmError) -> None:
        """Publish what holds, unless there is a reason to look again."""
        if self._halted:
            self._rest()
        elif self._stale or self.published is not base:
            self._stale = True  # the surfaces changed again, or another plan came
        elif len(job.kept) <= self.standing.executed:
            self._stale = True  # the robot went on to what does not hold: the next look says so
        else:
            self._restarts = 0
            self._cut(base, len(job.kept), failure_of(error))

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
        self._judge(Activity.FAILED, failure, invalid=())

    def _resumed(self, base: Published, candidates: tuple[int, ...]) -> Job:
        """The work that goes on from one of some states to the sequence's own goal."""
        snapshot, job, options = self._environment.snapshot, base.job, self._settings().replanning
        request = job.request
        kept = base.plan.states[: max(candidates) + 1]
        if job.bounds_derived:
            rule, roots = self._settings().bounds, [root_placement(kept[k]) for k in candidates]
            places = [request.start, request.goal, *roots]  # where surfaces are gone, too
            bounds = derived_bounds(places, snapshot.surfaces, rule)
            request = dataclasses.replace(request, bounds=bounds)
        return Job(
            uuid.uuid4().hex, job.robot, request, options.time_limit, snapshot, kept, candidates,
            bounds_derived=job.bounds_derived, keep_roadmaps=self._settings().keep_roadmaps,
        )  # fmt: skip

    def _validation_of(self, base: Published, first: int) -> Validation:
        least = base.job.request.min_robustness
        return self._validation(base.job.robot, base.key, base.plan, least, first)

    def _validation(
        self, robot: RobotChoice, key: str, plan: ContactPlan, least: float, first: int
    ) -> Validation:
        asked = plan.request
        return Validation(
            uuid.uuid4().hex, robot, key, plan.states, least, asked.gravity, asked.grip_force,
            first, self._environment.snapshot,
        )  # fmt: skip

    def _judge(self, activity: Activity, failure: Failure = SUCCEEDED, **changes: Any) -> None:
        """Take note of what was found of the published sequence, and tell it."""
        self._verdict = _Verdict(activity, failure)
        if self._halted or activity is Activity.VALID:  # no news beside a plan under way
            activity = self._resting()
        self._stand(activity=activity, failure=failure, **changes)

    def _rest(self, failure: Failure | None = None) -> None:
        """Tell what is so beside the news, which may be a failure."""
        if failure is None:
            failure = SUCCEEDED if self._verdict is None else self._verdict.failure
        self._stand(activity=self._resting(), failure=failure)

    def _resting(self) -> Activity:
        """What the planner does; or, where it does nothing, what is known of the sequence."""
        if self._halted:
            return Activity.IDLE
        if self._works:
            return Activity.PLANNING
        if self.published is None:
            return Activity.IDLE
        if self._replanning is not None:
            return Activity.REPLANNING
        return self.standing.activity if self._verdict is None else self._verdict.activity

    def _stand(self, **changes: object) -> None:
        self.standing = replace(self.standing, **changes)  # type: ignore[arg-type]
        if self._told != (self.published, self.standing):
            self._told = self.published, self.standing
            self._on_standing()


def _seen(snapshot: Snapshot) -> dict[str, Any]:
    """Of the standing: the surfaces that the sequence was held against."""
    return {"environment_version": snapshot.version, "surfaces_stamp": snapshot.stamp}


def _common(kept: Sequence[StateEntry], states: Sequence[StateEntry]) -> int:
    """How many of the states that might have been kept a sequence begins with."""
    same = (a == b for a, b in zip(kept, states, strict=False))
    return sum(itertools.takewhile(bool, same))
