"""For how much of the way ahead a contact can be kept."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rbprm_core.contacts.heuristics.candidates import Candidates


def persistence(candidates: Candidates) -> NDArray[np.float64]:
    """Share (m,) of the look-ahead along the guide at which the contact stays in the workspace.

    Not in the paper. A contact that leaves the workspace soon must be made again soon, and contacts
    that leave together stop the sequence; one test of points against the workspace's faces tells.
    """
    return candidates.persistence()
