"""The contact planner that follows a guide step by step (Tonneau et al. 2018, section 4)."""

from __future__ import annotations

from collections.abc import Sequence

from rbprm_core.arrays import Array
from rbprm_core.body.state import State
from rbprm_core.contacts.along_guide.generator import ContactGenerator
from rbprm_core.contacts.along_guide.sequence import plan_sequence
from rbprm_core.contacts.along_guide.start import start_state
from rbprm_core.contacts.along_guide.walk_state import walk_state
from rbprm_core.contacts.continuation import continued_state
from rbprm_core.contacts.protocol import ContactProblem, OnStates
from rbprm_core.counters import Counters
from rbprm_core.errors import GoalUnreachable
from rbprm_core.failures import Cause
from rbprm_core.guide.protocol import Guide

POSTURE_CAUSES = (Cause.NO_KINEMATIC_SOLUTION, Cause.REFERENCE_POSTURE_COLLISION)
"""Causes that hold for the reference posture only, from which the goal is tested.

With another posture the goal may admit the contacts, as at the top of a ladder.
"""


class AlongGuidePlanner:
    """Contact planner that follows a guide, one contact change a step.

    Args:
        problem: problem to work on.
    """

    def __init__(self, problem: ContactProblem) -> None:
        self._problem = problem
        self._generator = ContactGenerator(
            problem.data,
            problem.scene,
            problem.gravity,
            problem.robustness_threshold,
            problem.options.generator,
            problem.rng,
            problem.grip_force,
            problem.budget,
        )

    @property
    def counters(self) -> Counters:
        """See `ContactPlanner.counters`."""
        return self._generator.counters

    def start(self, root: Array) -> State:
        """See `ContactPlanner.start`."""
        problem = self._problem
        return start_state(self._generator, root, problem.start_limbs, budget=problem.budget)

    def resume(self, history: Sequence[State]) -> State:
        """See `ContactPlanner.resume`."""
        generator = self._generator
        return continued_state(generator.body, history[-1], generator.fallback_robustness)

    def check_goal(self, root: Array) -> None:
        """See `ContactPlanner.check_goal`; without goal limbs no single test tells."""
        problem = self._problem
        if not problem.goal_limbs:
            return
        try:
            start_state(self._generator, root, problem.goal_limbs, "goal", problem.budget)
        except GoalUnreachable as error:
            if error.failure.cause not in POSTURE_CAUSES:
                raise

    def follow(self, guide: Guide, history: Sequence[State], on_states: OnStates) -> list[State]:
        """See `ContactPlanner.follow`."""
        problem = self._problem
        first = walk_state(history, len(problem.data.robot.limbs))
        states = plan_sequence(
            self._generator,
            guide,
            first,
            problem.budget,
            problem.rng,
            problem.options.sequence,
            problem.goal_limbs,
            on_states,
        )
        return list(states)
