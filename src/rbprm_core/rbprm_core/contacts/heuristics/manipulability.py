"""Distance from singularity."""

from __future__ import annotations

from rbprm_core.arrays import Array
from rbprm_core.contacts.heuristics.candidates import Candidates


def manipulability(candidates: Candidates) -> Array:
    r"""Manipulability (m,) of each candidate, $\sqrt{\det(J J^T)}$.

    Tonneau et al. 2018, equation 17.

    Args:
        candidates: the candidates.
    """
    return candidates.manipulability
