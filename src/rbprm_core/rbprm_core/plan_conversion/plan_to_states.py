"""Core states from the words of a plan, or from what was measured, to go on from them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from rbprm_core.body.contact import Contact
from rbprm_core.body.state import State
from rbprm_core.body.transition import is_kept
from rbprm_core.errors import InvalidInput
from rbprm_core.placement import Placement
from rbprm_core.plan_record import ContactEntry, StateEntry
from rbprm_core.robot import Robot
from rbprm_core.robot.limb import Limb
from rbprm_core.robot.projection import project
from rbprm_core.scene import Scene, Surface
from rbprm_core.scene.supporting_surface import supporting_surface
from rbprm_core.statics import cone_generators
from rbprm_core.validation import coordinates, finite_array, one_of

Array = NDArray[np.float64]

EXACT = 1e-3
"""Metres between a limb and its contact, or a contact and its surface, that are left as they are:
a planned state stays what it was, to the last digit."""
EXACT_TURN = 5e-3  # radians, the same of a patch's orientation
MEASURED = 1e-2
"""Metres that the points of a measured contact may be off its surface, or its limb off it."""
MEASURED_TURN = float(np.deg2rad(8.0))  # radians, the same between their normals
BEYOND = 0.02  # radians or metres; a measured joint that far beyond its limit is put onto it


def state_from_plan(
    entry: StateEntry, robot: Robot, scene: Scene | None, field: str = "state"
) -> State:
    """A state from its words; contacts are taken oldest first, free limbs in the robot's order.

    Of a contact, limb, position, orientation and surface count; its points follow from the limb,
    its friction from the surface. An empty surface id stands for whichever surface carries it.

    A planned state (each contact within 1 mm of its surface and of its limb) comes back as it is.
    A measured one may be off by up to 1 cm and 8 degrees: its contacts are then laid onto their
    surfaces, the root moved by what its limbs are off in the mean, and the limbs projected onto
    their contacts, so that what is planned from it passes the check.
    Joints up to 0.02 rad beyond their limits are put onto them.

    Args:
        scene: whose surfaces carry the contacts; None asks nothing of surfaces, takes contacts as
            they are and friction from the entry.
        field: name of the state in errors.

    Raises:
        InvalidInput: wrong number of joints; values that are not finite or beyond limits; an
            unknown limb, or one twice; an unknown surface, or one that does not carry its contact;
            a limb that does not reach its contact.
    """
    q = _configuration(entry, robot, field)
    contacts: list[Contact] = []
    for k, text in enumerate(entry.contacts):
        place = f"{field}.contacts.{k}"
        contact = _contact(text, robot, scene, place)
        if any(contact.limb == other.limb for other in contacts):
            raise InvalidInput(f"{place}.limb", text.limb, "is in contact twice")
        contacts.append(contact)
    if scene is not None:
        q = _standing(q, contacts, robot, field)
    com = np.asarray(pin.centerOfMass(robot.model, robot.model.createData(), q, False)).copy()
    return State(q, tuple(contacts), com, float(entry.robustness))


def states_from_plan(
    entries: Sequence[StateEntry], robot: Robot, field: str = "states"
) -> tuple[State, ...]:
    """A whole sequence from its words; contacts of each state are in the order of their making.

    Contacts that a state keeps from the one before are the same objects. Surfaces are not tested:
    those of executed states may be gone.

    Raises:
        InvalidInput: see `state_from_plan`.
    """
    states: list[State] = []
    for i, entry in enumerate(entries):
        state = state_from_plan(entry, robot, None, f"{field}.{i}")
        states.append(_with_kept_contacts(states[-1], state) if states else state)
    return tuple(states)


def root_placement(entry: StateEntry, field: str = "state") -> Placement:
    """Where the root of a state is, from its words.

    Raises:
        InvalidInput: not finite, or no unit quaternion.
    """
    return Placement.parse(entry.root.position, entry.root.orientation, f"{field}.root")


def _with_kept_contacts(before: State, state: State) -> State:
    """The state with the contacts that it keeps first, in the order and as objects of before."""
    kept = [old for old in before.contacts if is_kept(old, state.contact_of(old.limb))]
    limbs = {contact.limb for contact in kept}
    made = [contact for contact in state.contacts if contact.limb not in limbs]
    return replace(state, contacts=(*kept, *made))


def _configuration(entry: StateEntry, robot: Robot, field: str) -> Array:
    root = root_placement(entry, field)
    joints = finite_array(f"{field}.joints", entry.joints, (-1,))
    if len(joints) != len(robot.joint_names):
        reason = f"has {len(joints)} values, {robot.name} has {len(robot.joint_names)} joints"
        raise InvalidInput(f"{field}.joints", list(entry.joints), reason)
    low, high = robot.low[7:], robot.high[7:]
    beyond = np.maximum(low - joints, joints - high)
    worst = int(np.argmax(beyond))
    if beyond[worst] > BEYOND:
        reason = f"joint {robot.joint_names[worst]} must lie in [{low[worst]:g}, {high[worst]:g}]"
        raise InvalidInput(f"{field}.joints.{worst}", float(joints[worst]), reason)
    return np.concatenate([root.position, root.orientation, np.clip(joints, low, high)])


def _contact(text: ContactEntry, robot: Robot, scene: Scene | None, field: str) -> Contact:
    """A contact from its words, laid onto its surface where that is not where it says it is."""
    names = [limb.name for limb in robot.limbs]
    index = names.index(one_of(f"{field}.limb", text.limb, names))
    limb = robot.limbs[index]
    position = coordinates(f"{field}.position", text.position, (3,))
    pose = Placement.parse(text.position, text.orientation, field)
    rotation = pose.transform.rotation
    friction, identity = text.friction, text.surface
    if scene is not None:
        surface = _surface(scene, limb, position, rotation, text, field)
        position, rotation = _laid(surface, position, rotation)
        friction, identity = surface.friction, surface.id
    points = position + limb.corners @ rotation.T
    rays = np.broadcast_to(cone_generators(rotation, friction), (len(points), 4, 3))
    spots = [spot.name for spot in limb.spots]
    spot = spots.index(one_of(f"{field}.spot", text.spot, spots)) if text.spot else 0
    return Contact(index, position, rotation, points, rays, friction, identity, spot)


def _surface(
    scene: Scene, limb: Limb, position: Array, rotation: Array, text: ContactEntry, field: str
) -> Surface:
    """The surface that a contact is on."""
    if text.surface and text.surface not in scene.index:
        reason = "the environment has no surface of this id; leave it empty if any will do"
        raise InvalidInput(f"{field}.surface", text.surface, reason)
    points = position + limb.corners @ rotation.T
    surface = supporting_surface(
        scene, points, rotation[:, 2], text.surface, MEASURED, MEASURED_TURN
    )
    if surface is None or text.surface not in ("", surface.id):
        which = f"surface {text.surface}" if text.surface else "no surface"
        verb = "does not carry" if text.surface else "carries"
        reason = f"{which} {verb} the whole contact within {1e3 * MEASURED:g} mm"
        raise InvalidInput(f"{field}.position", position.tolist(), reason)
    return surface


def _laid(surface: Surface, position: Array, rotation: Array) -> tuple[Array, Array]:
    """Position and rotation of a contact on its surface; the same where they are there already."""
    plane = surface.polygon.plane
    height = float((position - plane.origin) @ plane.normal)
    if abs(height) <= EXACT and rotation[:, 2] @ plane.normal >= np.cos(EXACT_TURN):
        return position, rotation
    turn = pin.Quaternion.FromTwoVectors(rotation[:, 2], plane.normal).matrix()
    return position - height * plane.normal, turn @ rotation


def _standing(q: Array, contacts: Sequence[Contact], robot: Robot, field: str) -> Array:
    """q with all limbs on their contacts; as it is where they are there already.

    The root goes along by what its limbs are off in the mean: a straight leg reaches no farther.

    Raises:
        InvalidInput: a limb that is farther off than a measurement may be, or gets there no way.
    """
    gaps = [_gap(q, contact, robot) for contact in contacts]
    if all(
        np.linalg.norm(gap) <= EXACT and (turn <= EXACT_TURN or not robot.limbs[c.limb].planar)
        for (gap, turn), c in zip(gaps, contacts, strict=True)
    ):
        return q
    q = q.copy()
    # Before it is used, for one wrong contact would drag the root away from all others.
    for k, ((gap, _), contact) in enumerate(zip(gaps, contacts, strict=True)):
        # Twice: the contact may have been moved onto its surface, and the limb is off itself.
        if np.linalg.norm(gap) > 2 * MEASURED:
            raise _unreached(gap, contact, robot, f"{field}.contacts.{k}")
    q[:3] += np.mean([gap for gap, _ in gaps], axis=0)
    for k, contact in enumerate(contacts):
        joints = _projected(q, contact, robot)
        if joints is None:
            raise _unreached(_gap(q, contact, robot)[0], contact, robot, f"{field}.contacts.{k}")
        q[robot.limbs[contact.limb].q_index] = joints
    return q


def _gap(q: Array, contact: Contact, robot: Robot) -> tuple[Array, float]:
    """Way (3,) from a limb's contact frame to where its contact has it, metres, and angle."""
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
    target = base.actInv(contact.position + limb.radius * contact.normal)
    rotation = base.rotation.T @ contact.rotation if limb.planar else None
    return project(limb, q[limb.q_index], target, rotation)


def _unreached(gap: Array, contact: Contact, robot: Robot, field: str) -> InvalidInput:
    name, off = robot.limbs[contact.limb].name, 1e3 * float(np.linalg.norm(gap))
    reason = (
        f"limb {name} is {off:.1f} mm from there, and cannot be put there from the state's joints: "
        f"at most {2e3 * MEASURED:g} mm are made up for"
    )
    return InvalidInput(f"{field}.position", contact.position.tolist(), reason)
