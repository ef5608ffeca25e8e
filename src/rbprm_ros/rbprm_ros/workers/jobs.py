"""What the node and its planning processes say to each other: plain data over a pipe."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from rbprm_core.budget import Progress
from rbprm_core.plan_record import ContactPlan, StateEntry
from rbprm_core.request import PlanRequest
from rbprm_core.robot import RobotDescription, load_description
from rbprm_ros.environment.store import Snapshot
from rbprm_ros.failure import Failure

if TYPE_CHECKING:
    from rbprm_core.replanning import InvalidState


@dataclass(frozen=True)
class RobotChoice:
    """A robot with the limbs that may make contact and the joints planned with the root.

    Attributes:
        name: known name, or path of a robot file.
        limbs, root_joints: names; empty for the robot's own choice.
    """

    name: str
    limbs: tuple[str, ...] = ()
    root_joints: tuple[str, ...] = ()

    def description(self) -> RobotDescription:
        """What the robot's file says, with what was chosen.

        Raises:
            InvalidInput: a file that cannot be used, or a limb that the robot does not have. Names
                of joints are looked at when the robot is loaded.
        """
        chosen = load_description(self.name)
        return chosen.using(self.limbs or None, self.root_joints or None)


@dataclass(frozen=True)
class Preparation:
    """Node to process: have the data of a robot at hand."""

    id: str
    robot: RobotChoice


@dataclass(frozen=True, eq=False)
class Job:
    """Node to process: plan.

    Attributes:
        id: of this piece of work.
        time_limit: seconds, from when the robot's data are there.
        snapshot: surfaces to plan on; None on the way to the process, which is sent changes.
        kept: states of the plan that may stay. Empty: from the beginning.
        candidates: indices of those to go on from, the best first; empty for the last alone.
        measured: whether `kept` is one state as measured, which may be a little off its contacts.
        bounds_derived: whether the request left its bounds open.
        shown: whether the states are reported while they grow, which takes a tenth of the time.
        keep_roadmaps: whether roadmaps of the guide planner are kept from one job to the next.
    """

    id: str
    robot: RobotChoice
    request: PlanRequest
    time_limit: float
    snapshot: Snapshot | None
    kept: tuple[StateEntry, ...] = ()
    candidates: tuple[int, ...] = ()
    measured: bool = False
    bounds_derived: bool = False
    shown: bool = False
    keep_roadmaps: bool = False


@dataclass(frozen=True, eq=False)
class Validation:
    """Node to process: tell which states do not hold.

    Attributes:
        id: of this piece of work.
        key: of the states; the process that got them before knows them by it.
        states: of the sequence; None where the process holds them already.
        threshold: least robustness, newtons. gravity: m/s^2.
        grip_force: what robustness without gravity is measured by, newtons.
        first: index of the first to look at.
        snapshot: surfaces of today; None on the way to the process, which is sent changes.
    """

    id: str
    robot: RobotChoice
    key: str
    states: tuple[StateEntry, ...] | None
    threshold: float
    gravity: tuple[float, float, float]
    grip_force: float
    first: int
    snapshot: Snapshot | None


@dataclass(frozen=True)
class Cancellation:
    """Node to process: stop a piece of work. One that has ended is not touched."""

    id: str


@dataclass(frozen=True)
class Done:
    """Process to node: what the work gave; None of a preparation."""

    id: str
    result: ContactPlan | tuple[InvalidState, ...] | None


@dataclass(frozen=True)
class Failed:
    """Process to node: the work failed, the process goes on.

    Attributes:
        partial: the states up to where it ended, as a plan; None where there are none.
    """

    id: str
    failure: Failure
    partial: ContactPlan | None = None


@dataclass(frozen=True)
class Reported:
    """Process to node: where the work stands.

    Attributes:
        states: of the sequence so far, None where they are the same as last time.
    """

    id: str
    progress: Progress
    states: tuple[StateEntry, ...] | None = None


Work = Preparation | Job | Validation
Answer = Done | Failed | Reported
Result = ContactPlan | tuple["InvalidState", ...] | None
