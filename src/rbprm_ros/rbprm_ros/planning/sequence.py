"""The published sequence."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

from rbprm_core.plan_conversion import with_states
from rbprm_core.plan_record import ContactPlan, StateEntry
from rbprm_ros.workers.jobs import Job


@dataclass(frozen=True, eq=False)
class PublishedSequence:
    """A revision of a sequence.

    Attributes:
        id: identifier of the sequence.
        revision: number of the revision, from 0.
        first_changed: index of the first state that differs from the revision before.
        plan: the states, and the guide of those planned last.
        job: work that gave it; replanning goes on with its request.
        stamp: when it was made, nanoseconds of the ROS clock.
        surfaces_stamp: stamp of the newest surfaces that it was planned on, likewise.
        complete: whether its last state is at the goal.
    """

    id: str
    revision: int
    first_changed: int
    plan: ContactPlan
    job: Job
    stamp: int
    surfaces_stamp: int
    complete: bool = True

    @property
    def key(self) -> str:
        """Identifier of the revision."""
        return f"{self.id}/{self.revision}"

    def revised(self, job: Job, plan: ContactPlan, stamp: int) -> PublishedSequence:
        """The next revision.

        Args:
            job: replanning work.
            plan: its result, from the first state on.
            stamp: time of now, nanoseconds of the ROS clock.
        """
        assert job.snapshot is not None
        first = 0 if job.measured else common_states(job.kept, plan.states)
        stamps = (stamp, job.snapshot.stamp)
        return PublishedSequence(self.id, self.revision + 1, first, plan, job, *stamps)

    def shortened(self, count: int, stamp: int) -> PublishedSequence:
        """The next revision, of the first states alone.

        Args:
            count: number of states that stay.
            stamp: time of now, nanoseconds of the ROS clock.
        """
        plan = with_states(self.plan, self.plan.states[:count])
        return replace(
            self,
            revision=self.revision + 1,
            first_changed=count,
            plan=plan,
            stamp=stamp,
            complete=False,
        )


def common_states(kept: Sequence[StateEntry], states: Sequence[StateEntry]) -> int:
    """Number of leading states that two sequences have in common.

    Args:
        kept: states of one sequence.
        states: states of the other.
    """
    same = (a == b for a, b in zip(kept, states, strict=False))
    return sum(itertools.takewhile(bool, same))
