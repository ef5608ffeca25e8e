"""Distance from the joint limits."""

from __future__ import annotations

import numpy as np

from rbprm_core.arrays import Array
from rbprm_core.contacts.heuristics.candidates import Candidates


def joint_limits(candidates: Candidates) -> Array:
    """Distance (m,) of the joint nearest to a limit, as a share of half of its range: 0 to 1.

    No formula of Tonneau et al. 2018; their section 6.2.2 finds that EFORT prefers postures at
    joint limits, which this heuristic counteracts.

    Args:
        candidates: the candidates.
    """
    low, high, joints = candidates.low, candidates.high, candidates.joints
    nearest = np.minimum(joints - low, high - joints)
    half = np.maximum(high - low, 1e-12) / 2
    return np.asarray((nearest / half).min(axis=1, initial=1.0))
