"""What a plan is asked for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from rbprm_core.contacts.along_guide.options import GeneratorOptions, SequenceOptions
from rbprm_core.errors import InvalidInput
from rbprm_core.guide.guide_options import GuideOptions
from rbprm_core.guide.root_space import RootBounds
from rbprm_core.placement import Placement
from rbprm_core.robot import Robot
from rbprm_core.statics import GRIP_FORCE
from rbprm_core.validation import MAX_COUNT, one_of

Array = NDArray[np.float64]


def limb_names(robot: Robot, names: Sequence[str], field: str) -> tuple[str, ...]:
    """Names of limbs of a robot, each once.

    Raises:
        InvalidInput: an unknown name, or one twice.
    """
    known = tuple(limb.name for limb in robot.limbs)
    if len(set(names)) != len(names):
        raise InvalidInput(field, list(names), "names a limb twice")
    return tuple(one_of(field, name, known) for name in names)


GRAVITY = np.array([0.0, 0.0, -9.81])


@dataclass(frozen=True)
class PlannerOptions:
    """Every option of the planner; the defaults serve the scenarios of the paper.

    Attributes:
        shortcuts: random shortcuts tried on a guide.
        settle: move the guide's roots towards the reference posture's height over the surfaces.
        guides: most guides tried; mostly the time limit comes first.
    """

    guide: GuideOptions = field(default_factory=GuideOptions)
    shortcuts: Annotated[int, Field(ge=0, le=MAX_COUNT)] = 100
    settle: bool = True
    guides: Annotated[int, Field(ge=1, le=MAX_COUNT)] = 1000
    generator: GeneratorOptions = field(default_factory=GeneratorOptions)
    sequence: SequenceOptions = field(default_factory=SequenceOptions)


@dataclass(frozen=True, eq=False)
class PlanRequest:
    """Start, goal and conditions.

    Attributes:
        start, goal: placements of the root in the planning frame.
        bounds: of the root along the whole way.
        required_limbs: names of the limbs whose workspace must meet a surface all along.
        start_limbs: names of the limbs in contact at the start.
        goal_limbs: names of the limbs that are to be in contact in the last state; None where any
            are good.
        robustness_threshold: least raw b0 of every state, newtons.
        seed: of everything that is random.
        gravity: (3,) m/s^2. Where it is zero every state is in force closure, and b0 is that of
            `rbprm_core.statics.grip`.
        grip_force: sum of the contact forces that b0 without gravity is measured by, newtons.
    """

    start: Placement
    goal: Placement
    bounds: RootBounds
    required_limbs: tuple[str, ...]
    start_limbs: tuple[str, ...]
    robustness_threshold: float
    seed: int = 0
    gravity: Array = field(default_factory=lambda: GRAVITY.copy())
    grip_force: float = GRIP_FORCE
    goal_limbs: tuple[str, ...] | None = None
    options: PlannerOptions = field(default_factory=PlannerOptions)

    @property
    def min_robustness(self) -> float:
        """Least raw b0 that a state of the plan may have, newtons; see `accept_below_threshold`."""
        return 0.0 if self.options.generator.accept_below_threshold else self.robustness_threshold
