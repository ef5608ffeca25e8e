"""What the node and its planning process say to each other: plain data over a pipe."""

from __future__ import annotations

from dataclasses import dataclass

from rbprm_core.budget import Progress
from rbprm_core.plan import ContactPlan
from rbprm_core.request import PlanRequest
from rbprm_ros.environment import Snapshot
from rbprm_ros.failure import Failure


@dataclass(frozen=True)
class Preparation:
    """Node to process: have the data of a robot at hand.

    Attributes:
        id: of this piece of work. robot: known name, or path of a robot file.
    """

    id: str
    robot: str


@dataclass(frozen=True, eq=False)
class Job:
    """Node to process: plan.

    Attributes:
        id: of this piece of work; becomes the id of the sequence. robot: as in `Preparation`.
        time_limit: seconds, from when the robot's data are there.
        snapshot: surfaces to plan on; None where the process holds them already.
    """

    id: str
    robot: str
    request: PlanRequest
    time_limit: float
    snapshot: Snapshot | None


@dataclass(frozen=True)
class Cancellation:
    """Node to process: stop a piece of work. One that has ended is not touched."""

    id: str


@dataclass(frozen=True)
class Done:
    """Process to node: the work's result; None of a preparation."""

    id: str
    plan: ContactPlan | None


@dataclass(frozen=True)
class Failed:
    """Process to node: the work failed, the process goes on."""

    id: str
    failure: Failure


@dataclass(frozen=True)
class Reported:
    """Process to node: where the work stands."""

    id: str
    progress: Progress


Work = Preparation | Job
Answer = Done | Failed | Reported
