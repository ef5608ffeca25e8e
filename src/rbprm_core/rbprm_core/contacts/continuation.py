"""A state of an earlier plan, or a measured one, as the first state of a new sequence."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rbprm_core.body.contact import Contact
from rbprm_core.body.state import State
from rbprm_core.body.state_failures import low_robustness, surface_lost
from rbprm_core.body.whole_body import WholeBody
from rbprm_core.errors import StartUnreachable
from rbprm_core.failures import Cause, Failure
from rbprm_core.scene.supporting_surface import supporting_surface
from rbprm_core.statics import cone_generators

ROUNDING = 1e-3
"""Newtons by which b0 may differ where it was computed elsewhere, or written and read."""


def continued_state(body: WholeBody, state: State, min_robustness: float) -> State:
    """The state on the surfaces of a scene: with their ids and friction, and its b0 on them.

    Contacts that do not change are the same objects as before.

    Args:
        body: whole-body queries of the robot in the scene.
        state: the state to go on from.
        min_robustness: b0 that it must reach, newtons.

    Raises:
        StartUnreachable: a contact without a surface, a collision, or too little robustness.
    """
    robot = body.robot
    contacts = tuple(_on_present_surface(body, contact) for contact in state.contacts)
    if not body.collision.root_free(state.q):
        raise StartUnreachable(Failure.of(Cause.ROOT_COLLISION))
    for k, limb in enumerate(robot.limbs):
        contact = state.contact_of(k)
        if not body.collision.limb_free(state.q, k, contact.normal if contact else None):
            raise StartUnreachable(Failure.of(Cause.LIMB_COLLISION, limb.name))
    value = body.robustness(state.q, contacts)
    if not value >= min_robustness - ROUNDING:
        raise StartUnreachable(low_robustness(value, min_robustness, len(contacts)))
    return replace(state, contacts=contacts, com=body.com(state.q), robustness=value)


def _on_present_surface(body: WholeBody, contact: Contact) -> Contact:
    """The contact with id and friction of the surface that supports it in the scene."""
    surface = supporting_surface(body.scene, contact.points, contact.normal, contact.surface)
    if surface is None:
        raise StartUnreachable(surface_lost(body.robot.limbs[contact.limb].name, contact))
    if (surface.id, surface.friction) == (contact.surface, contact.friction):
        return contact
    rays = np.broadcast_to(
        cone_generators(contact.rotation, surface.friction), contact.generators.shape
    )
    return replace(contact, generators=rays, friction=surface.friction, surface=surface.id)
