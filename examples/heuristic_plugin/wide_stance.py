"""A user's heuristic: it prefers contacts far from the limb's base, across the root's motion."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rbprm_core.contacts.heuristics import Candidates


def wide_stance(candidates: Candidates) -> NDArray[np.float64]:
    """Distance (m,) of each contact from the limb's base, perpendicular to the motion, metres.

    Args:
        candidates: the candidates of a limb.
    """
    along = candidates.centers @ candidates.direction
    across = candidates.centers - along[:, None] * candidates.direction
    return np.asarray(np.linalg.norm(across, axis=1))
