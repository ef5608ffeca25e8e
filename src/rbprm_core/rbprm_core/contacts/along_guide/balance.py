"""Prediction of the centre of mass before a limb is projected onto a contact."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from rbprm_core.arrays import Array, IntArray


@dataclass(frozen=True, eq=False)
class Balance:
    """Centre of mass of the robot with one limb as in any of its samples.

    Attributes:
        rest: (3,) centre of mass of the robot without the limb, multiplied by its share of the
            mass, in the planning frame, metres.
        share: mass of the limb divided by that of the robot.
        base: placement of the limb's base joint in the planning frame.
        coms: (m, 3) centres of mass of the limb's samples in the base frame, metres.
    """

    rest: Array
    share: float
    base: pin.SE3
    coms: Array

    def com(self, samples: IntArray) -> Array:
        """Centres of mass (h, 3) in the planning frame with the limb as in h samples, metres.

        Args:
            samples: (h,) indices of samples.
        """
        limb = self.coms[samples] @ self.base.rotation.T + self.base.translation
        return np.asarray(self.rest + self.share * limb)
