"""Interface of the motion stage: its problem, its planner and the motion.

The motion joins the states of a contact sequence (Park et al. 2016).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from rbprm_core.arrays import Array, IntArray
from rbprm_core.body.state import State
from rbprm_core.body.whole_body import WholeBody
from rbprm_core.budget import Budget


@dataclass(frozen=True, eq=False)
class MotionProblem:
    """Input of a motion planner.

    Attributes:
        body: whole-body queries of the robot in the scene.
        states: the contact sequence, start first.
        rng: the only source of random numbers.
        budget: time limit, cancel flag and progress, polled often.
    """

    body: WholeBody
    states: Sequence[State]
    rng: np.random.Generator
    budget: Budget = field(default_factory=Budget)


@dataclass(frozen=True, eq=False)
class Motion:
    """Samples of a whole-body motion.

    Attributes:
        times: (n,) times from the start of the motion, seconds, increasing.
        configurations: (n, nq) configurations.
        states: (n,) index of the state of the sequence that each sample leaves or is in.
    """

    times: Array
    configurations: Array
    states: IntArray


class MotionPlanner(Protocol):
    """A motion planner at work on one problem."""

    def plan(self) -> Motion:
        """The motion from the first to the last state.

        Raises:
            RbprmError: no motion was found.
            TimeLimitReached: raised by the budget.
            Cancelled: raised by the budget.
        """


MotionPlannerFactory = Callable[[MotionProblem], MotionPlanner]
"""Makes a motion planner for one problem."""
