"""Distance from singularity."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rbprm_core.contacts.heuristics.candidates import Candidates


def manipulability(candidates: Candidates) -> NDArray[np.float64]:
    """h_w = sqrt(det(J J^T)) (equation 17), (m,)."""
    return candidates.manipulability
