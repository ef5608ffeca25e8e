"""The request of a plan, as it stands in plan and scenario files; the one list of its fields."""

from __future__ import annotations

import math
from typing import Annotated, Any

from pydantic import Field

from rbprm_core.plan_record.records import PlanRecord, Pose
from rbprm_core.validation import MAX_FORCE, Acceleration, Coordinate, Robustness

MIN_GRIP = 1e-3  # newtons
MAX_TIME_LIMIT = 1e6  # seconds
GRIP_FORCE = 10.0  # newtons

Range = tuple[Coordinate, Coordinate]
HalfRange = Annotated[float, Field(ge=0, le=math.tau)]
Gravity = tuple[Acceleration, Acceleration, Acceleration]
GripForce = Annotated[float, Field(ge=MIN_GRIP, le=MAX_FORCE)]
TimeLimit = Annotated[float, Field(gt=0, le=MAX_TIME_LIMIT)]


class BoundsEntry(PlanRecord):
    """Where the root may be.

    Attributes:
        x: least and largest x of the root, metres.
        y: least and largest y of the root, metres.
        z: least and largest z of the root, metres.
        yaw: largest absolute angle about z, radians.
        pitch: largest absolute angle about y, radians.
        roll: largest absolute angle about x, radians.
    """

    x: Range
    y: Range
    z: Range
    yaw: HalfRange
    pitch: HalfRange
    roll: HalfRange


class RequestFields(PlanRecord):
    """What plan and scenario files have in common of a request; see `rbprm_core.request`.

    Attributes:
        start: pose of the root at the start.
        goal: pose of the root at the goal.
        bounds: where the root may be; None in files of version 1.
        required_limbs: names of the limbs whose workspace must meet a surface all along the guide;
            None for all limbs.
        start_limbs: names of the limbs in contact at the start; None for all limbs.
        goal_limbs: names of the limbs that are to be in contact in the last state; None where any
            limbs will do.
        robustness_threshold: minimum raw b0 of every state, newtons.
        gravity: (3,) gravity in the planning frame, m/s^2. Where it is zero every state is in force
            closure, and raw b0 would be 0 or unbounded: b0 is then the one at which the
            coefficients of the cone generators add up to `grip_force`.
        grip_force: sum of the contact forces by which b0 is measured without gravity, newtons.
        time_limit: longest planning time, seconds; None where the request sets none.
    """

    start: Pose
    goal: Pose
    bounds: BoundsEntry | None = None
    required_limbs: tuple[str, ...] | None = None
    start_limbs: tuple[str, ...] | None = None
    goal_limbs: tuple[str, ...] | None = None
    robustness_threshold: Robustness = 0.0
    gravity: Gravity = (0.0, 0.0, -9.81)
    grip_force: GripForce = GRIP_FORCE
    time_limit: TimeLimit | None = None


class StageNamesEntry(PlanRecord):
    """Which implementation of each stage made the plan, by name.

    Attributes:
        guide: name of the guide planner.
        contacts: name of the contact planner.
    """

    guide: str = "rrt"
    contacts: str = "along_guide"


class RequestEntry(RequestFields):
    """The whole request of a plan.

    Attributes:
        seed: seed of the random generator.
        position_tolerance: distance that the root of the first and of the last state may have from
            start and goal, metres.
        orientation_tolerance: angle that it may have from them, radians.
        stages: implementations by stage.
        options: every option of the planner, nested by stage; None in files of version 1.
    """

    seed: int = 0
    position_tolerance: Annotated[float, Field(ge=0)] = 1e-3
    orientation_tolerance: Annotated[float, Field(ge=0)] = 1e-3
    stages: StageNamesEntry = StageNamesEntry()
    options: dict[str, Any] | None = None
