"""Any candidate as good as another."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rbprm_core.contacts.heuristics.candidates import Candidates


def random(candidates: Candidates) -> NDArray[np.float64]:
    """Numbers (m,) drawn evenly from 0 to 1: the baseline that every other has to beat.

    They come from the request's generator, so that a seed gives the same ones again.
    """
    return candidates.rng.random(len(candidates))
