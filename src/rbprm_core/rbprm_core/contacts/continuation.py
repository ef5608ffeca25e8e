"""A state of an earlier plan, or a measured one, as the first state of a new sequence."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rbprm_core.body.contact import Contact
from rbprm_core.body.state import State
from rbprm_core.contacts.along_guide.generator import ContactGenerator
from rbprm_core.errors import StartUnreachable
from rbprm_core.scene.supporting_surface import supporting_surface
from rbprm_core.statics import cone_generators

ROUNDING = 1e-3
"""Newtons that b0 may differ by where it was computed elsewhere, or written and read."""


def continued_state(generator: ContactGenerator, state: State) -> State:
    """The state on the surfaces of the generator's scene: with their ids and friction, and its b0.

    Where nothing of that differs the contacts are the same objects as before.

    Raises:
        StartUnreachable: a contact without a surface, a collision, or too little robustness.
    """
    robot = generator.robot
    contacts = tuple(_today(generator, contact) for contact in state.contacts)
    if not generator.collision.root_free(state.q):
        raise StartUnreachable("the root part of the robot collides with the environment")
    for k, limb in enumerate(robot.limbs):
        contact = state.contact_of(k)
        if not generator.collision.limb_free(state.q, k, contact.normal if contact else None):
            raise StartUnreachable(f"limb {limb.name} is in collision", limb.name)
    value = generator.robustness(state.q, contacts)
    if not value >= generator.floor - ROUNDING:
        reason = (
            f"its {len(contacts)} contacts hold it with a robustness of {value:.3g} N, "
            f"{generator.floor:g} N are asked for"
        )
        raise StartUnreachable(reason)
    return replace(state, contacts=contacts, com=generator.com(state.q), robustness=value)


def _today(generator: ContactGenerator, contact: Contact) -> Contact:
    """The contact on the surface that carries it today."""
    surface = supporting_surface(generator.scene, contact.points, contact.normal, contact.surface)
    if surface is None:
        name = generator.robot.limbs[contact.limb].name
        at = ", ".join(f"{x:.3f}" for x in contact.position)
        raise StartUnreachable(f"no surface carries the contact of limb {name} at {at}", name)
    if (surface.id, surface.friction) == (contact.surface, contact.friction):
        return contact
    rays = np.broadcast_to(
        cone_generators(contact.rotation, surface.friction), contact.generators.shape
    )
    return replace(contact, generators=rays, friction=surface.friction, surface=surface.id)
