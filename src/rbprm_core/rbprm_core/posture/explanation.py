"""Why a posture problem has no solution: the first constraint without which it would have one.

The failure of a generator names the constraint that its last posture violates most. Where two
constraints contradict each other, that may be either. Solving the problem again without some of
them tells which: contacts and distances come first, then tasks, equilibrium, and torques.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from rbprm_core.arrays import Array
from rbprm_core.body.state import State
from rbprm_core.failures import Cause, Failure
from rbprm_core.posture.problem import PostureProblem
from rbprm_core.posture.protocol import PostureGenerator

HALVINGS = 8
"""Bisections by which the best value of a bound is found."""

Solve = Callable[[PostureProblem], State | Failure]


def explained_failure(
    generator: PostureGenerator, problem: PostureProblem, start: Array, failure: Failure
) -> Failure:
    """The failure of a problem, by the first of its constraints that cannot be met.

    Args:
        generator: the generator that has not solved the problem.
        problem: the problem.
        start: (nq,) configuration from which the search started.
        failure: the generator's failure, returned where nothing better is found.
    """

    def solve(changed: PostureProblem) -> State | Failure:
        return generator.solve(changed, start)

    bare = replace(problem, tasks=(), min_robustness=-np.inf, max_torque_ratio=None)
    if isinstance(found := solve(bare), Failure):
        return found
    posed = replace(bare, tasks=problem.tasks)
    if isinstance(found := solve(posed), Failure):
        return found
    balanced = replace(posed, min_robustness=problem.min_robustness)
    if problem.min_robustness > -np.inf and isinstance(solve(balanced), Failure):
        reached = _best_robustness(solve, balanced, found.robustness)
        return Failure.of(
            Cause.LOW_ROBUSTNESS,
            robustness=reached,
            threshold=problem.min_robustness,
            contacts=len(problem.supporting),
        )
    return failure


def _best_robustness(solve: Solve, problem: PostureProblem, known: float) -> float:
    """About the largest robustness that can be reached, newtons, at least a known one."""
    low, high = known, problem.min_robustness
    if not np.isfinite(low):
        found = solve(replace(problem, min_robustness=0.0))
        if isinstance(found, Failure):
            return known
        low = found.robustness
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        found = solve(replace(problem, min_robustness=middle))
        if isinstance(found, Failure):
            high = middle
        else:
            low = max(middle, found.robustness)
    return float(low)
