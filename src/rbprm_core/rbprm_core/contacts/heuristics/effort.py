"""EFORT: the force that a limb can exert against the motion."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rbprm_core.contacts.heuristics.candidates import Candidates


def effort(candidates: Candidates) -> NDArray[np.float64]:
    """h_EFORT = [m^T (J J^T) m]^(-1/2) (mu n^T m) (equation 15), (m,).

    m is opposite to the local motion: the limb pushes the root forward by pushing back.
    """
    m = -candidates.direction
    ratio = np.einsum("i,kij,j->k", m, candidates.grams, m)
    return np.asarray(candidates.friction * (candidates.normals @ m) / np.sqrt(ratio + 1e-12))
