"""Random ranking."""

from __future__ import annotations

from rbprm_core.arrays import Array
from rbprm_core.contacts.heuristics.candidates import Candidates


def random(candidates: Candidates) -> Array:
    """Numbers (m,) drawn uniformly from 0 to 1: the baseline of the other heuristics.

    They come from the random generator of the request: equal seeds give equal numbers.

    Args:
        candidates: the candidates.
    """
    return candidates.rng.random(len(candidates))
