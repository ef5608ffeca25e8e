"""Messages between the node and its worker processes: plain data."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from rbprm_core.budget import Progress
from rbprm_core.plan_record import ContactPlan, StateEntry
from rbprm_core.request import PlanRequest
from rbprm_core.robot import RobotDescription, load_description
from rbprm_ros.environment.snapshot import Snapshot
from rbprm_ros.errors import ErrorData

if TYPE_CHECKING:
    from rbprm_core.replanning import InvalidState


@dataclass(frozen=True)
class RobotChoice:
    """A robot, the limbs that may make contact and the joints planned with the root.

    Attributes:
        name: known name, or path of a robot file.
        limbs: names of the limbs; empty for the choice of the robot's description.
        root_joints: names of the joints; empty for the choice of the robot's description.
    """

    name: str
    limbs: tuple[str, ...] = ()
    root_joints: tuple[str, ...] = ()

    def description(self) -> RobotDescription:
        """The robot's description with the chosen limbs and joints.

        Raises:
            InvalidInput: a file that cannot be used, or a limb that the robot does not have. Names
                of joints are validated when the robot is loaded.
        """
        chosen = load_description(self.name)
        return chosen.using(self.limbs or None, self.root_joints or None)


@dataclass(frozen=True)
class Preparation:
    """Node to worker: load the data of a robot.

    Attributes:
        id: identifier of the work.
        robot: the robot.
    """

    id: str
    robot: RobotChoice


@dataclass(frozen=True, eq=False)
class Job:
    """Node to worker: plan.

    Attributes:
        id: identifier of the work.
        robot: the robot.
        request: what to plan.
        time_limit: planning time, seconds, from when the robot's data are loaded.
        snapshot: surfaces and obstacles; None on the way to the worker, which gets a
            `SnapshotDiff`.
        kept: states of an earlier plan that may stay; empty for a new plan.
        candidates: indices of the states in `kept` from which to replan, the best first; empty for
            the last one alone.
        measured: whether `kept` is one measured state, which may be a little off its contacts.
        bounds_derived: whether the caller left the bounds of the root to the node.
        shown: whether the states are reported while the sequence grows, which takes a tenth of the
            planning time.
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
    """Node to worker: find the states of a sequence that are invalid.

    Attributes:
        id: identifier of the work.
        robot: the robot.
        key: identifier of the states, under which the worker keeps the newest ones.
        states: the sequence; None where the worker holds it already.
        min_robustness: smallest valid robustness b0, newtons.
        gravity: (3,) m/s^2, planning frame.
        grip_force: sum of the contact forces that b0 without gravity refers to, newtons.
        first: index of the first state to validate.
        snapshot: surfaces and obstacles; None on the way to the worker, which gets a
            `SnapshotDiff`.
    """

    id: str
    robot: RobotChoice
    key: str
    states: tuple[StateEntry, ...] | None
    min_robustness: float
    gravity: tuple[float, float, float]
    grip_force: float
    first: int
    snapshot: Snapshot | None


@dataclass(frozen=True)
class Cancellation:
    """Node to worker: stop some work; without effect where the work has ended.

    Attributes:
        id: identifier of the work.
    """

    id: str


@dataclass(frozen=True)
class Done:
    """Worker to node: the work succeeded.

    Attributes:
        id: identifier of the work.
        result: a plan, the invalid states, or None for a preparation.
    """

    id: str
    result: ContactPlan | tuple[InvalidState, ...] | None


@dataclass(frozen=True)
class Failed:
    """Worker to node: the work failed; the worker goes on.

    Attributes:
        id: identifier of the work.
        error: why.
        partial: plan of the states found until then; None where there are none.
    """

    id: str
    error: ErrorData
    partial: ContactPlan | None = None


@dataclass(frozen=True)
class Reported:
    """Worker to node: progress of the work.

    Attributes:
        id: identifier of the work.
        progress: stage, share of it that is done, and elapsed time.
        states: states of the sequence so far; None where they are those of the last report.
    """

    id: str
    progress: Progress
    states: tuple[StateEntry, ...] | None = None


Work = Preparation | Job | Validation
Answer = Done | Failed | Reported
Result = ContactPlan | tuple["InvalidState", ...] | None
