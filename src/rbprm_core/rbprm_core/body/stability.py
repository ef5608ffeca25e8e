"""Robustness of contact sets, with weight or without."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rbprm_core.arrays import Array
from rbprm_core.body.contact import Contact
from rbprm_core.statics import Equilibrium, grip_robustness, robustness, robustness_gradient

MIN_CLOSURE = 1e-3
"""Share of the grip force; b0 without weight from which on force closure is beyond rounding."""


class Stability:
    """The robustness of one robot's contact sets.

    Args:
        mass: mass of the robot, kg.
        gravity: (3,) gravity in the planning frame, m/s^2.
        grip_force: sum of the contact forces by which b0 without weight is measured, newtons.
        threshold: b0 that the request asks of every state, newtons.

    Attributes:
        min_equilibrium: b0 below which no state is in equilibrium, newtons.
        min_robustness: b0 that every state must reach, newtons: the request's threshold, and
            without weight at least `min_equilibrium`.
    """

    def __init__(self, mass: float, gravity: Array, grip_force: float, threshold: float) -> None:
        self._mass, self._gravity, self._grip_force = mass, gravity, grip_force
        self._weightless = not (mass * gravity).any()
        self.min_equilibrium = MIN_CLOSURE * grip_force if self._weightless else 0.0
        self.min_robustness = (
            max(threshold, self.min_equilibrium) if self._weightless else threshold
        )

    def b0(self, contacts: Sequence[Contact], com: Array) -> float:
        """Robustness b0 of a contact set, newtons; minus infinity of an empty one.

        Args:
            contacts: the contacts that carry forces.
            com: (3,) centre of mass in the planning frame, metres.
        """
        if not contacts:
            return -np.inf
        points = np.concatenate([c.points for c in contacts])
        generators = np.concatenate([c.generators for c in contacts])
        if self._weightless:
            return grip_robustness(points, generators, self._grip_force)
        return robustness(Equilibrium.of(points, generators, com, self._mass, self._gravity))

    def b0_gradient(self, contacts: Sequence[Contact], com: Array) -> tuple[float, Array]:
        """Robustness b0 in newtons and a bound (3,) on its change with the centre of mass.

        A displacement d of the centre of mass changes b0 by at most gradient . d. The gradient is
        zero without weight, and NaN where b0 is not finite.

        Args:
            contacts: the contacts that carry forces.
            com: (3,) centre of mass in the planning frame, metres.
        """
        if not contacts or self._weightless:
            return self.b0(contacts, com), np.zeros(3)
        points = np.concatenate([c.points for c in contacts])
        generators = np.concatenate([c.generators for c in contacts])
        problem = Equilibrium.of(points, generators, com, self._mass, self._gravity)
        return robustness_gradient(problem)
