r"""Robust static equilibrium under gravity (Tonneau et al. 2018, section 5.1).

Contact forces are combinations of the generators of the friction cones with coefficients
$\beta$. A state is in static equilibrium where some $\beta \geq 0$ balances the weight. Its
robustness $b_0$ is the largest lower bound that all coefficients can have at once:

$b_0 = \max_{b, \beta} b$ subject to $G \beta = w$ and $\beta \geq b \mathbf{1}$

which is equation (8). `Equilibrium` states the problem and `robustness` solves it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rbprm_core.arrays import Array
from rbprm_core.errors import InvalidInput
from rbprm_core.statics.linear_program import max_min_coefficient, max_min_dual


@dataclass(frozen=True, eq=False)
class Equilibrium:
    r"""The balance $G \beta = w$ of Tonneau et al. 2018, equation (6), about the centre of mass.

    About the centre of mass the weight has no moment. So $w$ depends on the robot alone, and the
    numbers stay small wherever in the world the robot is.

    Attributes:
        generators: (6, 4 e) matrix $G$ of e contact points. A column holds a unit force (rows 0
            to 2, no unit) and its moment about the centre of mass (rows 3 to 5, metres).
        wrench: (6,) wrench $w$ that the contacts must exert: the force $-m g$ in newtons, then the
            moment 0. It must not be zero; `rbprm_core.statics.grip` covers robots without weight.
    """

    generators: Array
    wrench: Array

    @staticmethod
    def of(
        points: Array, generators: Array, com: Array, mass: float, gravity: Array
    ) -> Equilibrium:
        """Return the equilibrium problem of a robot on a set of contact points.

        Args:
            points: (e, 3) contact points, metres, world frame.
            generators: (e, 4, 3) unit generators of the friction cone at each point, world frame.
            com: (3,) centre of mass, metres, world frame.
            mass: mass of the robot, kilograms.
            gravity: (3,) acceleration of gravity, m/s^2, world frame.
        """
        wrench = np.zeros(6)
        wrench[:3] = -mass * gravity
        return Equilibrium(contact_wrenches(points - com, generators), wrench)


def contact_wrenches(arms: Array, generators: Array) -> Array:
    """Return the wrenches (6, 4 e) of unit forces along the generators, forces above moments.

    Args:
        arms: (e, 3) contact points relative to the point about which moments are taken, metres.
        generators: (e, 4, 3) unit generators of the friction cone at each point.
    """
    moments = np.empty_like(generators)  # arms x generators; np.cross is five times slower
    ax, ay, az = arms[:, None, 0], arms[:, None, 1], arms[:, None, 2]
    gx, gy, gz = generators[..., 0], generators[..., 1], generators[..., 2]
    moments[..., 0] = ay * gz - az * gy
    moments[..., 1] = az * gx - ax * gz
    moments[..., 2] = ax * gy - ay * gx
    return np.asarray(np.concatenate([generators, moments], axis=2).reshape(-1, 6).T)


def robustness(problem: Equilibrium) -> float:
    """Return the robustness $b_0$ in newtons, which is negative outside static equilibrium.

    It is the optimum of Tonneau et al. 2018, equation (8), computed from its dual (9).

    Args:
        problem: contacts and weight of the robot.

    Returns:
        $b_0$; minus infinity where no forces balance the weight, not even pulling ones, so that
        (8) is infeasible; infinity where the contacts can be pressed against each other without
        bound, as between two walls, so that (8) is unbounded.

    Raises:
        InvalidInput: the robot has no weight.
    """
    if problem.generators.shape[1] == 0:
        return -np.inf
    weight = _weight(problem)
    return weight * max_min_coefficient(problem.generators, problem.wrench / weight)


def robustness_gradient(problem: Equilibrium) -> tuple[float, Array]:
    r"""Return $b_0$ in newtons and a bound on its change with the centre of mass.

    With the dual solution $\nu = (a, b)$ of equation (9) and the force $F = -m g$, a displacement
    $d$ of the centre of mass changes $b_0$ by at most $(F \times b) \cdot d$.

    Args:
        problem: contacts and weight of the robot, moments about the centre of mass.

    Returns:
        $b_0$ as `robustness` returns it, and the gradient $F \times b$ (3,) in newtons a metre, NaN
        where $b_0$ is not finite.

    Raises:
        InvalidInput: the robot has no weight.
    """
    if problem.generators.shape[1] == 0:
        return -np.inf, np.full(3, np.nan)
    weight = _weight(problem)
    optimum, dual = max_min_dual(problem.generators, problem.wrench / weight)
    (x, y, z), (a, b, c) = problem.wrench[:3], dual[3:]  # np.cross takes as long as the program
    return weight * optimum, np.array([y * c - z * b, z * a - x * c, x * b - y * a])


def _weight(problem: Equilibrium) -> float:
    """Largest component of the weight, newtons."""
    weight = float(np.abs(problem.wrench).max())
    if weight == 0.0:
        raise InvalidInput(
            "gravity", 0.0, "must not be zero: `grip_robustness` is for robots without weight"
        )
    return weight
