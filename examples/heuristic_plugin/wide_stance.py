"""A heuristic of one's own: contacts far from the limb's base, across the way of the root."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rbprm_core.contacts.heuristics import Candidates


def wide_stance(candidates: Candidates) -> NDArray[np.float64]:
    """Distance (m,) in metres of the contact from the base, less its part along the motion."""
    along = candidates.centers @ candidates.direction
    across = candidates.centers - along[:, None] * candidates.direction
    return np.asarray(np.linalg.norm(across, axis=1))
