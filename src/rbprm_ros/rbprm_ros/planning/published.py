"""The sequence that is out, and how it stands on the surfaces of today. No ROS here."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum

from rbprm_core.plan_record import ContactPlan
from rbprm_core.replanning import InvalidState
from rbprm_ros.failure import SUCCEEDED, Failure
from rbprm_ros.workers.jobs import Job


class Activity(IntEnum):
    """What the planner does; PlannerStatus has the same."""

    IDLE = 0
    PLANNING = 1
    VALID = 2
    INVALIDATED = 3
    REPLANNING = 4
    FAILED = 5


@dataclass(frozen=True, eq=False)
class Published:
    """A revision of a sequence.

    Attributes:
        id: of the sequence. revision: counts from 0.
        first_changed: index of the first state that differs from the revision before.
        plan: the states, and the guide of those planned last.
        job: that asked for it; its request is gone on with.
        stamp: when it was made, nanoseconds of the ROS clock.
        surfaces_stamp: of the newest surfaces that it was made on, likewise.
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
        """Identity of the revision."""
        return f"{self.id}/{self.revision}"


@dataclass(frozen=True)
class Standing:
    """How the planner and the published sequence stand.

    Attributes:
        activity: what is done. invalid: states that do not hold, those not executed yet.
        executed: index of the state that the robot is in, -1 if nobody said.
        failure: why planning failed; success otherwise.
        environment_version: of the surfaces that the sequence was last held against; 0 for none.
        surfaces_stamp: theirs, nanoseconds of the ROS clock.
    """

    activity: Activity = Activity.IDLE
    invalid: tuple[InvalidState, ...] = ()
    executed: int = -1
    failure: Failure = field(default=SUCCEEDED)
    environment_version: int = 0
    surfaces_stamp: int = 0
