"""Distance of the limb's joints from the reference posture."""

from __future__ import annotations

import numpy as np

from rbprm_core.arrays import Array
from rbprm_core.contacts.heuristics.candidates import Candidates


def reference(candidates: Candidates) -> Array:
    """Negative distance (m,) of the limb's joints from the reference posture, in joint space.

    In radians; one metre of a prismatic joint counts as one. No formula of Tonneau et al. 2018.

    Args:
        candidates: the candidates.
    """
    return -np.asarray(np.linalg.norm(candidates.joints - candidates.reference, axis=1))
