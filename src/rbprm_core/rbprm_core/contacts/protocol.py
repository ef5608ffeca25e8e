"""Interface of the contact stage (P2): its problem, and its planner.

The pipeline uses only what stands here. An implementation is chosen by name, see
`rbprm_core.contacts.registry`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from rbprm_core.arrays import Array
from rbprm_core.body.state import State
from rbprm_core.budget import Budget
from rbprm_core.contacts.contact_options import ContactOptions
from rbprm_core.counters import Counters
from rbprm_core.guide.protocol import Guide
from rbprm_core.robot.data import RobotData
from rbprm_core.scene import Scene
from rbprm_core.statics import GRIP_FORCE

OnStates = Callable[[Sequence[State]], None]
"""Called with the states found so far, the first state first, whenever one is added."""


@dataclass(frozen=True, eq=False)
class ContactProblem:
    """Input of a contact planner.

    Attributes:
        data: robot with its limb workspaces, limb samples and collision bodies.
        scene: supporting surfaces and obstacles, in the planning frame.
        gravity: (3,) gravity in the planning frame, m/s^2.
        robustness_threshold: raw b0 that every state must reach, newtons.
        rng: the only source of random numbers.
        start_limbs: indices of the limbs in contact at the start, in the order in which they make
            contact.
        goal_limbs: indices of the limbs to be in contact in the last state; empty where any will
            do.
        grip_force: sum of the contact forces by which b0 without weight is measured, newtons.
        options: options of the contact planners.
        budget: time limit, cancel flag and progress, polled often.
    """

    data: RobotData
    scene: Scene
    gravity: Array
    robustness_threshold: float
    rng: np.random.Generator
    start_limbs: tuple[int, ...]
    goal_limbs: tuple[int, ...] = ()
    grip_force: float = GRIP_FORCE
    options: ContactOptions = field(default_factory=ContactOptions)
    budget: Budget = field(default_factory=Budget)


class ContactPlanner(Protocol):
    """A contact planner at work on one problem; it may be given several guides in turn."""

    @property
    def counters(self) -> Counters:
        """Counts and seconds of its operations, for the statistics."""

    def start(self, root: Array) -> State:
        """The first state, with the problem's start limbs in contact.

        Args:
            root: (7 + j,) root configuration of the start.

        Raises:
            StartUnreachable: there is none.
            TimeLimitReached: raised by the budget.
            Cancelled: raised by the budget.
        """

    def resume(self, history: Sequence[State]) -> State:
        """The last state of an earlier sequence, with contacts and b0 as in the problem's scene.

        Args:
            history: states of the earlier sequence, one at least.

        Raises:
            StartUnreachable: a contact lost its surface, or the state collides or is not in
                equilibrium.
        """

    def check_goal(self, root: Array) -> None:
        """Test whether the goal admits the problem's goal limbs in contact, whatever the guide.

        Args:
            root: (7 + j,) root configuration of the goal.

        Raises:
            GoalUnreachable: it certainly does not.
            TimeLimitReached: raised by the budget.
            Cancelled: raised by the budget.
        """

    def follow(self, guide: Guide, history: Sequence[State], on_states: OnStates) -> list[State]:
        """States along a guide from its start to its end, of which neighbours differ by one limb.

        Args:
            guide: path of the root.
            history: the states before, the last of which is the first of the result.
            on_states: called with the states so far whenever one is added.

        Raises:
            NoSequenceFound: the guide cannot be followed to its end.
            TimeLimitReached: raised by the budget.
            Cancelled: raised by the budget.

            Each carries the states found until then, and the share of the guide that they cover.
        """


ContactPlannerFactory = Callable[[ContactProblem], ContactPlanner]
"""Makes a contact planner for one problem."""
