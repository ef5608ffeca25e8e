"""Fitting of a measured state: its contacts onto their surfaces, its limbs onto their contacts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from rbprm_core.arrays import Array
from rbprm_core.body.contact import Contact
from rbprm_core.errors import InvalidInput
from rbprm_core.robot import Robot
from rbprm_core.robot.projection import project
from rbprm_core.scene import Surface

EXACT = 1e-3
"""Distance in metres between a limb and its contact, or a contact and its surface, up to which they
are left as they are: a planned state stays the same to the last digit."""
EXACT_ANGLE = 5e-3
"""The same for the orientation of a patch, radians."""
MEASURED = 1e-2
"""Largest distance in metres of the points of a measured contact from its surface, and of a limb
from its contact."""
MEASURED_ANGLE = float(np.deg2rad(8.0))
"""Largest angle between the normals of a measured contact and of its surface, radians."""


def on_surface(surface: Surface, position: Array, rotation: Array) -> tuple[Array, Array]:
    """Position (3,) and rotation (3, 3) of a contact frame, moved onto its surface.

    Both are unchanged where the contact is on the surface already.

    Args:
        surface: surface of the contact.
        position: (3,) origin of the contact frame, metres.
        rotation: (3, 3) orientation of the contact frame; its third column is the normal.
    """
    plane = surface.polygon.plane
    height = float((position - plane.origin) @ plane.normal)
    if abs(height) <= EXACT and rotation[:, 2] @ plane.normal >= np.cos(EXACT_ANGLE):
        return position, rotation
    turn = pin.Quaternion.FromTwoVectors(rotation[:, 2], plane.normal).matrix()
    return position - height * plane.normal, turn @ rotation


def on_contacts(
    q: Array, contacts: Sequence[Contact], robot: Robot, fields: Sequence[str]
) -> Array:
    """Configuration (nq,) with all limbs on their contacts; unchanged where they are there already.

    The root moves by the mean distance of the limbs from their contacts, since a straight leg could
    not reach farther; inverse kinematics then puts each limb onto its contact.

    Args:
        q: (nq,) measured configuration.
        contacts: contacts of the state.
        robot: the robot.
        fields: name of the position of each contact, for errors.

    Raises:
        InvalidInput: a limb that is farther off than a measurement may be, or that inverse
            kinematics cannot put onto its contact.
    """
    gaps = [_gap(q, contact, robot) for contact in contacts]
    if all(
        np.linalg.norm(gap) <= EXACT and (turn <= EXACT_ANGLE or not robot.limbs[c.limb].planar)
        for (gap, turn), c in zip(gaps, contacts, strict=True)
    ):
        return q
    q = q.copy()
    # Tested before the mean is used: one wrong contact would move the root away from all others.
    for k, ((gap, _), contact) in enumerate(zip(gaps, contacts, strict=True)):
        # Twice: the contact may have been moved onto its surface, and the limb is off itself.
        if np.linalg.norm(gap) > 2 * MEASURED:
            raise _not_reached(gap, contact, robot, fields[k])
    q[:3] += np.mean([gap for gap, _ in gaps], axis=0)
    for k, contact in enumerate(contacts):
        joints = _projected(q, contact, robot)
        if joints is None:
            raise _not_reached(_gap(q, contact, robot)[0], contact, robot, fields[k])
        q[robot.limbs[contact.limb].q_index] = joints
    return q


def _gap(q: Array, contact: Contact, robot: Robot) -> tuple[Array, float]:
    """Vector (3,) from a limb's contact frame to its place on the contact, metres, and angle."""
    limb, data = robot.limbs[contact.limb], robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, q)
    frame = data.oMf[limb.frame] * limb.contact
    way = contact.position + limb.radius * contact.normal - frame.translation
    return way, float(np.linalg.norm(pin.log3(frame.rotation.T @ contact.rotation)))


def _projected(q: Array, contact: Contact, robot: Robot) -> Array | None:
    """Joints (n,) that put a limb onto its contact, None where there are none."""
    limb, data = robot.limbs[contact.limb], robot.model.createData()
    pin.forwardKinematics(robot.model, data, q)
    base = data.oMi[limb.base]
    position, rotation = limb.target(base, contact.position, contact.rotation)
    return project(limb, q[limb.q_index], position, rotation)


def _not_reached(gap: Array, contact: Contact, robot: Robot, field: str) -> InvalidInput:
    name, off = robot.limbs[contact.limb].name, 1e3 * float(np.linalg.norm(gap))
    reason = (
        f"limb {name} is {off:.1f} mm from there, and cannot be put there from the state's joints: "
        f"at most {2e3 * MEASURED:g} mm are corrected"
    )
    return InvalidInput(field, contact.position.tolist(), reason)
