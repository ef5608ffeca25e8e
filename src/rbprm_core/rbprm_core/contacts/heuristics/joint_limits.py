"""Distance from the joint limits."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rbprm_core.contacts.heuristics.candidates import Candidates


def joint_limits(candidates: Candidates) -> NDArray[np.float64]:
    """Distance (m,) of the joint nearest to a limit, as a share of half of its range: 0 to 1.

    Not one of the paper's formulas; its section 6.2.2 finds that EFORT tends to joint limits,
    against which this is added to it.
    """
    low, high, joints = candidates.low, candidates.high, candidates.joints
    nearest = np.minimum(joints - low, high - joints)
    half = np.maximum(high - low, 1e-12) / 2
    return np.asarray((nearest / half).min(axis=1, initial=1.0))
