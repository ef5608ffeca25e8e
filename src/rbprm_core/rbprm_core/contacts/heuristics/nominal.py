"""Distance from the contact of the reference posture, further along the guide."""

from __future__ import annotations

import numpy as np

from rbprm_core.arrays import Array
from rbprm_core.contacts.heuristics.candidates import Candidates


def nominal(candidates: Candidates) -> Array:
    """Negative distance (m,) in metres of each candidate from the nominal contact.

    Not in Tonneau et al. 2018. The nominal contact is that of the reference posture at the root in
    the middle of the look-ahead, or at the present root where the robot rests. Limbs then keep the
    stance that the robot's makers chose; manipulability alone lets them wander from it.

    Args:
        candidates: the candidates.
    """
    return -np.asarray(np.linalg.norm(candidates.centers - candidates.nominal, axis=1))
