"""Nearness of the limb's joints to the reference posture."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rbprm_core.contacts.heuristics.candidates import Candidates


def reference(candidates: Candidates) -> NDArray[np.float64]:
    """Minus the distance (m,) of the limb's joints to the reference posture, in joint space.

    Not one of the paper's formulas. In radians, a prismatic joint's metre counting as one.
    """
    return -np.asarray(np.linalg.norm(candidates.joints - candidates.reference, axis=1))
