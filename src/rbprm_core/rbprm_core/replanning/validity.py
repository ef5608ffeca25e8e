"""Which states of a sequence do not hold in a scene, and why: fast enough to ask at every change.

What depends on the states alone (where the bodies are, robustness as planned) is computed once a
sequence. A change of the scene then costs the contacts' surfaces, the boxes of all bodies against
the boxes of what was added, and an exact test of what is left.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

import coal
import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from rbprm_core.body.collision import LIFT
from rbprm_core.body.contact import Contact
from rbprm_core.body.stability import Stability
from rbprm_core.body.state import State
from rbprm_core.contacts.continuation import ROUNDING
from rbprm_core.errors import InvalidInput
from rbprm_core.robot.data import RobotData
from rbprm_core.scene import Scene, Surface
from rbprm_core.scene.changes import added_triangles
from rbprm_core.scene.supporting_surface import supporting_surface
from rbprm_core.scene.triangles import mesh_shape
from rbprm_core.statics import GRIP_FORCE, cone_generators

Array = NDArray[np.float64]


class Reason(IntEnum):
    """Why a state does not hold. Values are part of the interface: messages use them."""

    SURFACE_LOST = 1
    COLLISION = 2
    NOT_IN_EQUILIBRIUM = 3


@dataclass(frozen=True)
class InvalidState:
    """A state that does not hold.

    Attributes:
        index: in the sequence.
        reason: the first of the reasons, in their order, that it fails by.
        limb: name of the limb at fault, "" where it is the root part or no single one.
        surface: id of the surface that was lost, "" for other reasons.
        text: the reason with its figures, for people.
    """

    index: int
    reason: Reason
    limb: str
    surface: str
    text: str


class ValidityMonitor:
    """One sequence, to be held against one scene after the other. Not thread-safe.

    Args:
        threshold: least b0 of a state, newtons; where the planner was told to take the most robust
            states under it (`accept_below_threshold`), 0. gravity: (3,) m/s^2.
        grip_force: what b0 without gravity is measured by, newtons.
        free: a scene in which no state collides, as the one that they were planned in.

    Raises:
        InvalidInput: a state of another robot.
    """

    def __init__(
        self,
        data: RobotData,
        states: Sequence[State],
        threshold: float,
        gravity: Array,
        grip_force: float = GRIP_FORCE,
        free: Scene | None = None,
    ) -> None:
        robot = data.robot
        for i, state in enumerate(states):
            if state.q.shape != robot.low.shape:
                reason = f"has {len(state.q)} numbers, the robot {robot.name} {len(robot.low)}"
                raise InvalidInput(f"states.{i}.q", state.q.tolist(), reason)
        self.states = tuple(states)
        self._names = [limb.name for limb in robot.limbs]
        self._stability = Stability(robot.mass, gravity, grip_force, threshold)
        self._bodies = _PlacedBodies(data, self.states)
        self._planned = [self._stability.b0(state.contacts, state.com) for state in self.states]
        self._free, self._free_from = free, 0
        """The newest scene in which no state collides, from an index on."""

    def invalid(self, scene: Scene, first: int = 0) -> tuple[InvalidState, ...]:
        """The states from `first` on that do not hold in a scene, in order, one reason each.

        Only what is new since the last scene in which none of them collided is tested for
        collisions; contacts and equilibrium are looked at in any case.
        """
        found: dict[int, InvalidState] = {}
        supporting_surfaces: dict[
            int, Surface | None
        ] = {}  # by contact: neighbours share most of theirs
        hit = self._hit(scene, first)
        for i in range(first, len(self.states)):
            state = self.states[i]
            for contact in state.contacts:
                if id(contact) not in supporting_surfaces:
                    supporting_surfaces[id(contact)] = supporting_surface(
                        scene, contact.points, contact.normal, contact.surface
                    )
            on = [supporting_surfaces[id(contact)] for contact in state.contacts]
            invalid = self._lost(i, on) or self._collides(i, hit) or self._falls(i, on)
            if invalid is not None:
                found[i] = invalid
        return tuple(found.values())

    def _hit(self, scene: Scene, first: int) -> dict[int, int]:
        """For each state from `first` on that collides, a hull that does."""
        before = self._free if self._free_from <= first else None
        hit = self._bodies.hit(_shapes(scene, before), first)
        if not hit:  # of the states, not of what is told of them: a lost surface comes first there
            self._free, self._free_from = scene, first
        return hit

    def _lost(self, i: int, on: list[Surface | None]) -> InvalidState | None:
        """The state's first contact that nothing carries."""
        for contact, surface in zip(self.states[i].contacts, on, strict=True):
            if surface is None:
                limb, was = self._names[contact.limb], contact.surface
                at = ", ".join(f"{x:.3f}" for x in contact.position)
                text = f"no surface carries the contact of {limb} at ({at}) m, which was on {was}"
                return InvalidState(i, Reason.SURFACE_LOST, limb, was, text)
        return None

    def _collides(self, i: int, hit: dict[int, int]) -> InvalidState | None:
        """The state's first body that is in something."""
        if i not in hit:
            return None
        body = hit[i]
        owner = self._bodies.owner[body]
        limb = self._names[owner] if owner >= 0 else ""
        text = f"body {self._bodies.names[body]} collides with the environment"
        return InvalidState(i, Reason.COLLISION, limb, "", text)

    def _falls(self, i: int, on: list[Surface | None]) -> InvalidState | None:
        """The state where friction is not enough any more."""
        state, value = self.states[i], self._planned[i]
        frictions = [0.0 if surface is None else surface.friction for surface in on]
        if any(mu != c.friction for mu, c in zip(frictions, state.contacts, strict=True)):
            rubbing = [_rubbing(c, mu) for c, mu in zip(state.contacts, frictions, strict=True)]
            value = self._stability.b0(rubbing, state.com)
        least = self._stability.threshold
        if value >= least - ROUNDING:
            return None
        text = f"robustness {value:.3g} N under {least:g} N"
        return InvalidState(i, Reason.NOT_IN_EQUILIBRIUM, "", "", text)


class _PlacedBodies:
    """All hulls of a robot in all states of a sequence; a limb in contact is lifted (`LIFT`).

    Attributes:
        owner: (b,) limb of each hull, -1 for the root part. names: of the hulls.
    """

    def __init__(self, data: RobotData, states: Sequence[State]) -> None:
        bodies, model = data.bodies, data.robot.model
        objects = bodies.objects[: bodies.hulls]
        self.owner = bodies.owner[: bodies.hulls]
        self.names = [body.name for body in objects]
        self._shapes = [body.geometry for body in objects]
        for shape in self._shapes:
            shape.computeLocalAABB()
        low = np.array([shape.aabb_local.min_ for shape in self._shapes])
        high = np.array([shape.aabb_local.max_ for shape in self._shapes])
        rotations, places = _joint_placements(model, states)
        joints = [body.parentJoint for body in objects]
        turns = np.array([body.placement.rotation for body in objects])
        shifts = np.array([body.placement.translation for body in objects])
        self._rotations = rotations[:, joints] @ turns
        self._places = places[:, joints] + np.einsum("sbij,bj->sbi", rotations[:, joints], shifts)
        last = bodies.last[: bodies.hulls]
        for i, state in enumerate(states):
            for contact in state.contacts:
                self._places[i, last & (self.owner == contact.limb)] += LIFT * contact.normal
        middle = np.einsum("sbij,bj->sbi", self._rotations, (low + high) / 2) + self._places
        extent = np.einsum("sbij,bj->sbi", np.abs(self._rotations), (high - low) / 2)
        self._low, self._high = middle - extent, middle + extent
        self._request = coal.CollisionRequest()
        # Without contacts coal gives up on some pairs that are millimetres deep in each other.
        self._request.enable_contact = True

    def hit(self, shapes: Sequence[coal.BVHModelOBBRSS], first: int) -> dict[int, int]:
        """For each state from `first` on that has one, a hull that is in one of some shapes."""
        still, found = coal.Transform3s(), dict[int, int]()
        for shape in shapes:
            shape.computeLocalAABB()
            low, high = np.array(shape.aabb_local.min_), np.array(shape.aabb_local.max_)
            near = (self._low[first:] <= high) & (self._high[first:] >= low)
            for state, body in np.argwhere(near.all(axis=2)):
                i = first + int(state)
                if i in found:
                    continue
                pose = coal.Transform3s(self._rotations[i, body], self._places[i, body])
                result = coal.CollisionResult()
                coal.collide(self._shapes[body], pose, shape, still, self._request, result)
                if result.isCollision():
                    found[i] = int(body)
        return found


def _joint_placements(model: pin.Model, states: Sequence[State]) -> tuple[Array, Array]:
    """Rotations (s, j, 3, 3) and positions (s, j, 3) of all joints in the planning frame."""
    data = model.createData()
    rotations = np.empty((len(states), model.njoints, 3, 3))
    places = np.empty((len(states), model.njoints, 3))
    for i, state in enumerate(states):
        pin.forwardKinematics(model, data, state.q)
        for j in range(model.njoints):
            rotations[i, j], places[i, j] = data.oMi[j].rotation, data.oMi[j].translation
    return rotations, places


def _shapes(scene: Scene, before: Scene | None) -> Sequence[coal.BVHModelOBBRSS]:
    """What may be hit: everything, or what is new since another scene."""
    if before is None:
        return scene.shapes
    return [mesh_shape(triangles) for triangles in added_triangles(before, scene)]


def _rubbing(contact: Contact, friction: float) -> Contact:
    """The contact with another coefficient of friction."""
    rays = np.broadcast_to(cone_generators(contact.rotation, friction), contact.generators.shape)
    return Contact(
        contact.limb, contact.position, contact.rotation, contact.points, rays, friction,
        contact.surface,
    )  # fmt: skip
