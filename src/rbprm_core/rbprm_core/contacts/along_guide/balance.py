"""Where the centre of mass would be, before a limb is projected onto a contact."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Balance:
    """Centre of mass of the robot with one limb as in any of its samples.

    Attributes:
        rest: (3,) centre of mass of everything but the limb, times its share of the mass, metres.
        share: of the robot's mass that the limb carries.
        base: placement of the limb's base in the world.
        coms: (m, 3) centres of mass of the limb's samples in the base frame, metres.
    """

    rest: Array
    share: float
    base: pin.SE3
    coms: Array

    def com(self, samples: NDArray[np.int_]) -> Array:
        """Centres of mass (h, 3) in the world with the limb as in h samples, metres."""
        limb = self.coms[samples] @ self.base.rotation.T + self.base.translation
        return np.asarray(self.rest + self.share * limb)
