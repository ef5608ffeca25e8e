"""Events of planning and monitoring, and the status that follows from them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from rbprm_core.plan_record import StateEntry
from rbprm_core.replanning import InvalidState
from rbprm_ros.environment.snapshot import Snapshot
from rbprm_ros.errors import NO_ERROR, ErrorData
from rbprm_ros.planning.sequence import PublishedSequence, common_states
from rbprm_ros.planning.status import Facts, PlannerStatus, Validity, status_of
from rbprm_ros.workers.jobs import Job


class StatusTracker:
    """The published sequence, and the planner's status; each event is one method.

    Args:
        on_status: called after every event that changed sequence or status.

    Attributes:
        published: the published sequence; None before the first.
        status: the status.
    """

    def __init__(self, on_status: Callable[[], None]) -> None:
        self.published: PublishedSequence | None = None
        self.status = PlannerStatus()
        self._facts = Facts()
        self._on_status = on_status
        self._reported: tuple[PublishedSequence | None, PlannerStatus] = None, self.status

    @property
    def active(self) -> bool:
        """Whether the node is active."""
        return self._facts.active

    @property
    def executed(self) -> int:
        """Index of the state that the robot is in; -1 where it is unknown."""
        return self.status.executed

    def activate(self, environment_version: int) -> None:
        """The node is active.

        Args:
            environment_version: version of the current environment.
        """
        self._change(active=True, is_news=False)
        unknown = self._facts.validity in (Validity.PLANNED, Validity.REPLANNED)
        if unknown or environment_version != self.status.environment_version:
            self._change(validity=Validity.UNKNOWN, sequence_error=NO_ERROR)
        self._report()

    def deactivate(self) -> None:
        """The node is not active."""
        self._change(active=False, is_news=False, call_error=NO_ERROR)
        self._report()

    def begin_call(self) -> None:
        """A call for a plan waits or is served."""
        self._change(planning=True, is_news=False, call_error=NO_ERROR)
        self._report()

    def end_call(self, others: bool, error: ErrorData = NO_ERROR) -> None:
        """A call ended without a plan.

        Args:
            others: whether other calls wait or are served.
            error: error that the status is to show.
        """
        self._change(planning=others, is_news=False, call_error=error)
        self._report()

    def publish(
        self,
        sequence: PublishedSequence,
        validity: Validity,
        executed: int,
        planning: bool | None = None,
    ) -> None:
        """A sequence was published; it has not been validated yet.

        Args:
            sequence: the sequence.
            validity: `PLANNED` or `REPLANNED`.
            executed: index of the state that the robot is in; -1 where it is unknown.
            planning: whether calls wait or are served; None leaves that as it was.
        """
        assert sequence.job.snapshot is not None
        self.published = sequence
        self._change(
            planning=self._facts.planning if planning is None else planning,
            published=True,
            replanning=False,
            validity=validity,
            is_news=False,
            call_error=NO_ERROR,
            sequence_error=NO_ERROR,
        )
        self.status = replace(self.status, executed=executed)
        self._report((), sequence.job.snapshot)

    def record_validation(
        self,
        validity: Validity,
        invalid: tuple[InvalidState, ...] | None = None,
        snapshot: Snapshot | None = None,
        error: ErrorData = NO_ERROR,
    ) -> None:
        """The published sequence was validated, or this failed.

        Args:
            validity: the result.
            invalid: invalid states that are not executed yet; None leaves those of before.
            snapshot: environment that it was validated against; None leaves that of before.
            error: error behind `Validity.FAILED`.
        """
        self._change(validity=validity, is_news=True, call_error=NO_ERROR, sequence_error=error)
        self._report(invalid, snapshot)

    def record_valid_states(self, snapshot: Snapshot) -> None:
        """All states of a sequence that ends before its goal are valid in an environment.

        Args:
            snapshot: the environment.
        """
        self._report((), snapshot)

    def begin_replanning(self) -> None:
        """Automatic replanning waits or is under way."""
        self._change(replanning=True, is_news=True)
        self._report()

    def end_replanning(self) -> None:
        """Automatic replanning ended; not reported, since the next event tells the result."""
        self._change(replanning=False)

    def record_execution(self, sequence_id: str, revision: int, state: int) -> None:
        """The executive reported the state that the robot is in or moves to.

        A report about the revision before the published one counts as far as both have the same
        states: it may have been under way. Reports about other sequences and revisions are ignored.

        Args:
            sequence_id: identifier of the executed sequence.
            revision: its revision.
            state: index of the state.
        """
        base = self.published
        if base is None or sequence_id != base.id:
            return
        if revision == base.revision:
            last = len(base.plan.states) - 1
        elif revision == base.revision - 1:
            last = base.first_changed - 1
        else:
            return
        self.status = replace(self.status, executed=max(min(state, last), self.executed))
        self._report()

    def why_outdated(
        self, job: Job, base: PublishedSequence, states: tuple[StateEntry, ...]
    ) -> str:
        """Why the result of replanning is of no use any more; "" where it is of use.

        Args:
            job: replanning work.
            base: sequence that was replanned.
            states: states of the result.
        """
        if self.published is not base:
            return f"sequence {base.id} has another revision now; call again"
        if not job.measured and common_states(job.kept, states) <= self.executed:
            return f"the robot moved on to state {self.executed} meanwhile; call again"
        return ""

    def _change(self, **facts: Any) -> None:
        self._facts = replace(self._facts, **facts)

    def _report(
        self, invalid: tuple[InvalidState, ...] | None = None, snapshot: Snapshot | None = None
    ) -> None:
        """Compute the status, and call back where sequence or status changed."""
        activity, error = status_of(self._facts)
        status = replace(self.status, activity=activity, error=error)
        if invalid is not None:
            status = replace(status, invalid=invalid)
        if snapshot is not None:
            status = replace(
                status, environment_version=snapshot.version, surfaces_stamp=snapshot.stamp
            )
        self.status = status
        if self._reported != (self.published, status):
            self._reported = self.published, status
            self._on_status()
