"""Contacts and whole-body contact states."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Contact:
    """One contact of a limb, in the planning frame.

    Attributes:
        limb: index of the limb.
        position: (3,) contact point, or middle of the patch, metres.
        rotation: (3, 3) contact frame, columns t1, t2 and the outward normal n.
        points: (k, 3) points that carry forces: 1, or the 4 corners of the patch, metres.
        generators: (k, 4, 3) unit rays of the friction cone of each point.
        friction: coefficient. surface: id of the surface.
    """

    limb: int
    position: Array
    rotation: Array
    points: Array
    generators: Array
    friction: float
    surface: str

    @property
    def normal(self) -> Array:
        """Outward unit normal (3,)."""
        return self.rotation[:, 2]


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
