"""From the states of a plan, or from a measured state, to states of the planner."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from rbprm_core.arrays import Array
from rbprm_core.body.contact import Contact
from rbprm_core.body.state import State
from rbprm_core.body.transition import is_kept
from rbprm_core.errors import InvalidInput
from rbprm_core.placement import Placement
from rbprm_core.plan_conversion.measured_state import (
    MEASURED,
    MEASURED_ANGLE,
    on_contacts,
    on_surface,
)
from rbprm_core.plan_record import ContactEntry, StateEntry
from rbprm_core.robot import Robot
from rbprm_core.robot.limb import Limb
from rbprm_core.scene import Scene, Surface
from rbprm_core.scene.supporting_surface import supporting_surface
from rbprm_core.statics import cone_generators
from rbprm_core.validation import coordinates, finite_array, naming_fields, one_of

MAX_BEYOND_LIMIT = 0.02
"""How far a measured joint may be beyond its limit, radians or metres; it is put onto the limit."""


@dataclass(frozen=True)
class StateFields:
    """Names of the fields of a state in errors; the defaults are those of plan files.

    Attributes:
        joints: values of the joints.
        position: position of a contact.
        orientation: orientation of a contact.
        surface: id of the surface of a contact.
    """

    joints: str = "joints"
    position: str = "position"
    orientation: str = "orientation"
    surface: str = "surface"


PLAN_FILE = StateFields()


def state_from_plan(
    entry: StateEntry,
    robot: Robot,
    scene: Scene | None,
    field: str = "state",
    names: StateFields = PLAN_FILE,
) -> State:
    """The state of a plan's entry, or of a measured one.

    Of a contact, limb, position, orientation and surface count; its points follow from the limb,
    its friction from the surface. An empty surface id stands for any surface that supports it.

    A planned state (each contact within 1 mm of its surface and of its limb) comes back as it is.
    A measured one may be off by up to 1 cm and 8 degrees: its contacts are then laid onto their
    surfaces, the root is moved by the mean distance of the limbs from their contacts, and the limbs
    are projected onto their contacts, so that what is planned from it passes the check.
    Joints up to 0.02 rad beyond their limits are put onto them.

    Args:
        entry: the state as a plan holds it; contacts in the order of their making.
        robot: the robot.
        scene: scene whose surfaces support the contacts; None tests no surfaces, and takes poses
            and friction of the contacts from the entry.
        field: name of the state in errors.
        names: names of its fields in errors.

    Raises:
        InvalidInput: wrong number of joints; values that are not finite or beyond limits; an
            unknown limb, or one twice; an unknown surface, or one that does not support its
            contact; a limb that does not reach its contact.
    """
    q = _configuration(entry, robot, field, names)
    contacts: list[Contact] = []
    for k, text in enumerate(entry.contacts):
        place = f"{field}.contacts.{k}"
        contact = _contact(text, robot, scene, place, names)
        if any(contact.limb == other.limb for other in contacts):
            raise InvalidInput(f"{place}.limb", text.limb, "is in contact twice")
        contacts.append(contact)
    if scene is not None:
        fields = [f"{field}.contacts.{k}.{names.position}" for k in range(len(contacts))]
        q = on_contacts(q, contacts, robot, fields)
    com = np.asarray(pin.centerOfMass(robot.model, robot.model.createData(), q, False)).copy()
    return State(q, tuple(contacts), com, float(entry.robustness))


def states_from_plan(
    entries: Sequence[StateEntry],
    robot: Robot,
    field: str = "states",
    names: StateFields = PLAN_FILE,
) -> tuple[State, ...]:
    """The states of a plan; contacts of each state are in the order of their making.

    Contacts that a state keeps from the one before are the same objects. Surfaces are not tested:
    those of executed states may be gone.

    Args:
        entries: states as a plan holds them.
        robot: the robot.
        field: name of the sequence of states in errors.
        names: names of a state's fields in errors.

    Raises:
        InvalidInput: see `state_from_plan`.
    """
    states: list[State] = []
    for i, entry in enumerate(entries):
        state = state_from_plan(entry, robot, None, f"{field}.{i}", names)
        states.append(_with_kept_contacts(states[-1], state) if states else state)
    return tuple(states)


def root_placement(entry: StateEntry, field: str = "state") -> Placement:
    """The placement of the root of a state.

    Args:
        entry: the state as a plan holds it.
        field: name of the state in errors.

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


def _configuration(entry: StateEntry, robot: Robot, field: str, names: StateFields) -> Array:
    """Configuration (nq,) of a state, with joints inside their limits."""
    root = root_placement(entry, field)
    place = f"{field}.{names.joints}"
    joints = finite_array(place, entry.joints, (-1,))
    if len(joints) != len(robot.joint_names):
        reason = f"has {len(joints)} values, {robot.name} has {len(robot.joint_names)} joints"
        raise InvalidInput(place, list(entry.joints), reason)
    low, high = robot.low[7:], robot.high[7:]
    beyond = np.maximum(low - joints, joints - high)
    worst = int(np.argmax(beyond))
    if beyond[worst] > MAX_BEYOND_LIMIT:
        reason = f"joint {robot.joint_names[worst]} must lie in [{low[worst]:g}, {high[worst]:g}]"
        raise InvalidInput(f"{place}.{worst}", float(joints[worst]), reason)
    return np.concatenate([root.position, root.orientation, np.clip(joints, low, high)])


def _contact(
    entry: ContactEntry, robot: Robot, scene: Scene | None, field: str, names: StateFields
) -> Contact:
    """A contact, laid onto its surface where a scene is given."""
    limb_names = [limb.name for limb in robot.limbs]
    index = limb_names.index(one_of(f"{field}.limb", entry.limb, limb_names))
    limb = robot.limbs[index]
    position = coordinates(f"{field}.{names.position}", entry.position, (3,))
    with naming_fields({"pose.orientation": f"{field}.{names.orientation}"}):
        pose = Placement.parse(entry.position, entry.orientation, "pose")
    rotation = pose.transform.rotation
    friction, identity = entry.friction, entry.surface
    if scene is not None:
        surface = _surface(scene, limb, position, rotation, entry, field, names)
        position, rotation = on_surface(surface, position, rotation)
        friction, identity = surface.friction, surface.id
    points = position + limb.corners @ rotation.T
    rays = np.broadcast_to(cone_generators(rotation, friction), (len(points), 4, 3))
    spots = [spot.name for spot in limb.spots]
    spot = spots.index(one_of(f"{field}.spot", entry.spot, spots)) if entry.spot else 0
    return Contact(index, position, rotation, points, rays, friction, identity, spot)


def _surface(
    scene: Scene,
    limb: Limb,
    position: Array,
    rotation: Array,
    entry: ContactEntry,
    field: str,
    names: StateFields,
) -> Surface:
    """The surface that supports a contact."""
    if entry.surface and entry.surface not in scene.index:
        reason = "the environment has no surface of this id; leave it empty if any will do"
        raise InvalidInput(f"{field}.{names.surface}", entry.surface, reason)
    points = position + limb.corners @ rotation.T
    surface = supporting_surface(
        scene, points, rotation[:, 2], entry.surface, MEASURED, MEASURED_ANGLE
    )
    if surface is None or entry.surface not in ("", surface.id):
        which = f"surface {entry.surface}" if entry.surface else "no surface"
        verb = "does not support" if entry.surface else "supports"
        reason = f"{which} {verb} the whole contact within {1e3 * MEASURED:g} mm"
        raise InvalidInput(f"{field}.{names.position}", position.tolist(), reason)
    return surface
