"""EFORT: the force that a limb can exert opposite to the motion of the root."""

from __future__ import annotations

import numpy as np

from rbprm_core.arrays import Array
from rbprm_core.contacts.heuristics.candidates import Candidates


def effort(candidates: Candidates) -> Array:
    r"""EFORT (m,) of each candidate, $[m^T (J J^T) m]^{-1/2} (\mu\, n^T m)$.

    m is opposite to the local motion: the limb moves the root forward by pushing backward
    (Tonneau et al. 2018, equation 15).

    Args:
        candidates: the candidates.
    """
    m = -candidates.direction
    ratio = np.einsum("i,kij,j->k", m, candidates.grams, m)
    return np.asarray(candidates.friction * (candidates.normals @ m) / np.sqrt(ratio + 1e-12))
