"""Nearness to where the reference posture would put the effector a little further on."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rbprm_core.contacts.heuristics.candidates import Candidates


def nominal(candidates: Candidates) -> NDArray[np.float64]:
    """Minus the distance (m,) in metres to the nominal place.

    Not in the paper. The nominal place is the effector's in the reference posture, at the root in
    the middle of the look-ahead; at rest, at the root itself. Limbs then keep a stance that the
    robot's makers chose, instead of wandering to wherever manipulability peaks.
    """
    return -np.asarray(np.linalg.norm(candidates.centers - candidates.nominal, axis=1))
