"""How firmly contacts hold a robot, with weight or without."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rbprm_core.body.contact import Contact
from rbprm_core.statics import Equilibrium, grip_robustness, robustness

Array = NDArray[np.float64]

CLOSED = 1e-3  # of the grip force; least b0 without weight that is safely over rounding


class Stability:
    """The robustness of one robot's contact sets.

    Args:
        mass: of the robot, kg. gravity: (3,) m/s^2.
        grip_force: sum of the contact forces that b0 without weight is measured by, newtons.
        threshold: least b0 asked for, newtons.

    Attributes:
        least: b0 under which nothing holds, newtons.
        threshold: least b0 of a state, newtons: what is asked for, and never under `least`
            without weight.
    """

    def __init__(self, mass: float, gravity: Array, grip_force: float, threshold: float) -> None:
        self._mass, self._gravity, self._grip_force = mass, gravity, grip_force
        self._weightless = not (mass * gravity).any()
        self.least = CLOSED * grip_force if self._weightless else 0.0
        self.threshold = max(threshold, self.least) if self._weightless else threshold

    def b0(self, contacts: Sequence[Contact], com: Array) -> float:
        """b0 of contacts with the centre of mass (3,) somewhere, newtons; -inf of none."""
        if not contacts:
            return -np.inf
        points = np.concatenate([c.points for c in contacts])
        generators = np.concatenate([c.generators for c in contacts])
        if self._weightless:
            return grip_robustness(points, generators, self._grip_force)
        return robustness(Equilibrium.of(points, generators, com, self._mass, self._gravity))
