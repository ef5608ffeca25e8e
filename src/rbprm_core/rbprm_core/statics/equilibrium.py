"""The robust equilibrium problem: the largest b0 such that every cone coefficient is at least b0.

The problem (`Equilibrium`) knows forces and moments; its solution (`robustness`) knows the solver.
"""

from __future__ import annotations

from dataclasses import dataclass

import daqp
import numpy as np
from numpy.typing import NDArray

from rbprm_core.errors import RbprmError

Array = NDArray[np.float64]

EQUALITY = 5  # DAQP's mark of an equality constraint
OPTIMAL, INFEASIBLE, UNBOUNDED = 1, -1, -3  # DAQP's exit flags
MOST = (
    1e6  # newtons; said to be b0 where contacts can be pressed without bound: JSON has no infinity
)
BALANCED = 1e-9  # of the weight; a residual of the balance below this is rounding


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """Equation (6) with moments about the centre of mass: G beta = w, beta >= b0.

    About the centre of mass the weight has no moment, so w depends on the robot alone, and the
    numbers stay small wherever in the world the robot stands.

    Attributes:
        generators: G (6, 4 e): forces above, moments about the centre of mass below.
        wrench: w (6,) that the contacts must exert: -m g above, 0 below, newtons.
    """

    generators: Array
    wrench: Array

    @staticmethod
    def of(
        points: Array, generators: Array, com: Array, mass: float, gravity: Array
    ) -> Equilibrium:
        """The problem of a set of contact points.

        Args:
            points: (e, 3) metres. generators: (e, 4, 3) of their cones.
            com: (3,) centre of mass. mass: kilograms. gravity: (3,) m/s^2.
        """
        arms = (points - com)[:, None]
        moments = np.empty_like(generators)  # arms x generators; np.cross is five times slower
        ax, ay, az = arms[..., 0], arms[..., 1], arms[..., 2]
        gx, gy, gz = generators[..., 0], generators[..., 1], generators[..., 2]
        moments[..., 0] = ay * gz - az * gy
        moments[..., 1] = az * gx - ax * gz
        moments[..., 2] = ax * gy - ay * gx
        columns = np.concatenate([generators, moments], axis=2).reshape(-1, 6)
        wrench = np.zeros(6)
        wrench[:3] = -mass * gravity
        return Equilibrium(columns.T, wrench)


def robustness(problem: Equilibrium) -> float:
    """Raw b0 in newtons: the optimum of (8), by its dual (9).

    minimise w . nu subject to G^T nu >= 0 and 1^T G^T nu = 1, over nu in R^6; equal to the
    optimum of (8) by duality.

    Returns:
        Minus infinity where no forces, not even pulling ones, balance it: (8) is infeasible.
        MOST where the contacts can be pressed against each other without bound, as between two
        walls: (8) is unbounded.
    """
    count = problem.generators.shape[1]
    if count == 0:
        return -np.inf
    weight = float(np.abs(problem.wrench).max()) or 1.0
    rows = np.empty((count + 1, 6))
    rows[:count] = problem.generators.T
    rows[count] = problem.generators.sum(axis=1)
    upper, lower = np.full(count + 1, np.inf), np.zeros(count + 1)
    upper[count] = lower[count] = 1.0
    sense = np.zeros(count + 1, dtype=np.int32)
    sense[count] = EQUALITY
    # Eliminating the equality first matters: without it DAQP calls 3 % of three-contact problems
    # unbounded that are not.
    _, optimum, flag, _ = daqp.solve(
        None, problem.wrench / weight, rows, upper, lower, sense, eq_reduction=1
    )
    if flag == OPTIMAL:
        return min(float(optimum) * weight, MOST)
    if flag == UNBOUNDED:
        return -np.inf
    if flag == INFEASIBLE:  # of the dual: (8) is unbounded, unless it is infeasible itself
        return MOST if _balanced(problem, weight) else -np.inf
    raise RbprmError(f"the statics problem was not solved: DAQP ended with flag {flag}")


def _balanced(problem: Equilibrium, weight: float) -> bool:
    """True where some coefficients, of either sign, balance the wrench."""
    wrench = problem.wrench / weight
    found, *_ = np.linalg.lstsq(problem.generators, wrench, rcond=None)
    return bool(np.abs(problem.generators @ found - wrench).max() < BALANCED)
