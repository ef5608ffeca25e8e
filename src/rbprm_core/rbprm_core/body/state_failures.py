"""Failures of whole-body states, as data."""

from __future__ import annotations

from rbprm_core.body.contact import Contact
from rbprm_core.failures import Cause, Failure


def low_robustness(robustness: float, threshold: float, contacts: int) -> Failure:
    """The failure of a state whose robustness is too small.

    Args:
        robustness: b0 of the state, newtons.
        threshold: b0 to be reached, newtons.
        contacts: number of its contacts.
    """
    return Failure.of(
        Cause.LOW_ROBUSTNESS, robustness=robustness, threshold=threshold, contacts=contacts
    )


def surface_lost(limb: str, contact: Contact) -> Failure:
    """The failure of a contact that no surface supports.

    Args:
        limb: name of the limb.
        contact: the contact.
    """
    x, y, z = contact.position.tolist()
    return Failure.of(Cause.SURFACE_LOST, limb, surface=contact.surface, x=x, y=y, z=z)
