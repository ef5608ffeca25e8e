"""A whole-body configuration and its contacts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rbprm_core.body.contact import Contact

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class State:
    """A whole-body configuration and its contacts (appendix B).

    Attributes:
        q: (nq,) configuration.
        contacts: oldest first: the order in which contacts are moved (FIFO).
        free: indices of the limbs not in contact, free for longest first.
        com: (3,) centre of mass, metres.
        robustness: raw b0 in newtons.
    """

    q: Array
    contacts: tuple[Contact, ...]
    free: tuple[int, ...]
    com: Array
    robustness: float

    def contact_of(self, limb: int) -> Contact | None:
        """The contact of a limb, None where it is free."""
        return next((c for c in self.contacts if c.limb == limb), None)
