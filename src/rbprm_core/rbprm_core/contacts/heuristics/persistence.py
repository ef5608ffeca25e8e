"""Share of the guide ahead along which a contact can be kept."""

from __future__ import annotations

from rbprm_core.arrays import Array
from rbprm_core.contacts.heuristics.candidates import Candidates


def persistence(candidates: Candidates) -> Array:
    """Share (m,) of the roots ahead on the guide at which the contact stays in the workspace.

    Not in Tonneau et al. 2018. A contact that leaves the workspace soon must be made again soon,
    and contacts that leave together stop the sequence.

    Args:
        candidates: the candidates.
    """
    return candidates.persistence()
