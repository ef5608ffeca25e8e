"""The robust equilibrium problem: the largest b0 such that every cone coefficient is at least b0.

The problem (`Equilibrium`) knows forces and moments; its solution (`robustness`) knows the solver.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rbprm_core.errors import InvalidInput
from rbprm_core.statics.program import largest_least

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """Equation (6) with moments about the centre of mass: G beta = w, beta >= b0.

    About the centre of mass the weight has no moment, so w depends on the robot alone, and the
    numbers stay small wherever in the world the robot stands.

    Attributes:
        generators: G (6, 4 e): forces above, moments about the centre of mass below.
        wrench: w (6,) that the contacts must exert: -m g above, 0 below, newtons; not zero, for
            without weight robustness has another meaning (`rbprm_core.statics.grip`).
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
        wrench = np.zeros(6)
        wrench[:3] = -mass * gravity
        return Equilibrium(contact_wrenches(points - com, generators), wrench)


def contact_wrenches(arms: Array, generators: Array) -> Array:
    """G (6, 4 e): unit forces above, their moments below.

    Args:
        arms: (e, 3) contact points from where moments are taken. generators: (e, 4, 3) unit rays.
    """
    moments = np.empty_like(generators)  # arms x generators; np.cross is five times slower
    ax, ay, az = arms[:, None, 0], arms[:, None, 1], arms[:, None, 2]
    gx, gy, gz = generators[..., 0], generators[..., 1], generators[..., 2]
    moments[..., 0] = ay * gz - az * gy
    moments[..., 1] = az * gx - ax * gz
    moments[..., 2] = ax * gy - ay * gx
    return np.asarray(np.concatenate([generators, moments], axis=2).reshape(-1, 6).T)


def robustness(problem: Equilibrium) -> float:
    """Raw b0 in newtons: the optimum of (8), by its dual (9).

    Returns:
        Minus infinity where no forces, not even pulling ones, balance it: (8) is infeasible.
        Infinity where the contacts can be pressed against each other without bound, as between two
        walls: (8) is unbounded.

    Raises:
        InvalidInput: no weight.
    """
    if problem.generators.shape[1] == 0:
        return -np.inf
    weight = float(np.abs(problem.wrench).max())
    if weight == 0.0:
        raise InvalidInput("gravity", 0.0, "without weight, robustness is that of the grip")
    return weight * largest_least(problem.generators, problem.wrench / weight)
