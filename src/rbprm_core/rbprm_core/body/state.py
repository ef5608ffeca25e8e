"""A whole-body configuration and its contacts."""

from __future__ import annotations

from dataclasses import dataclass

from rbprm_core.arrays import Array
from rbprm_core.body.contact import Contact


@dataclass(frozen=True, eq=False)
class State:
    """A whole-body configuration in static equilibrium on its contacts.

    Attributes:
        q: (nq,) configuration: position and quaternion [x, y, z, w] of the root in the planning
            frame, then joint positions in radians or metres.
        contacts: the contacts, one a limb at most, in the order in which they were made.
        com: (3,) centre of mass in the planning frame, metres.
        robustness: raw b0, newtons.
    """

    q: Array
    contacts: tuple[Contact, ...]
    com: Array
    robustness: float

    def contact_of(self, limb: int) -> Contact | None:
        """The contact of a limb, None where it is free.

        Args:
            limb: index of the limb.
        """
        return next((c for c in self.contacts if c.limb == limb), None)
