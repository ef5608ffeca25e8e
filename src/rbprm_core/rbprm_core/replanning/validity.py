"""Validity of the states of a sequence in a changing scene.

What depends on the states alone (placements of the bodies, robustness as planned) is computed once
for a sequence. A change of the scene then costs a search of the contacts' surfaces, a comparison of
the boxes of all bodies with those of the added triangles, and an exact test of the pairs left.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import IntEnum

import coal
import numpy as np

from rbprm_core.arrays import Array
from rbprm_core.body.contact import Contact
from rbprm_core.body.stability import Stability
from rbprm_core.body.state import State
from rbprm_core.body.state_failures import low_robustness, surface_lost
from rbprm_core.contacts.continuation import ROUNDING
from rbprm_core.errors import InvalidInput
from rbprm_core.failure_text import failure_text
from rbprm_core.failures import Cause, Failure
from rbprm_core.replanning.placed_bodies import PlacedBodies
from rbprm_core.robot.data import RobotData
from rbprm_core.scene import Scene, Surface
from rbprm_core.scene.changes import added_triangles
from rbprm_core.scene.supporting_surface import supporting_surface
from rbprm_core.scene.triangles import mesh_shape
from rbprm_core.statics import GRIP_FORCE, cone_generators


class Reason(IntEnum):
    """Why a state is invalid. The values are part of the interface: messages use them."""

    SURFACE_LOST = 1
    COLLISION = 2
    NOT_IN_EQUILIBRIUM = 3


REASONS = {
    Cause.SURFACE_LOST: Reason.SURFACE_LOST,
    Cause.BODY_COLLISION: Reason.COLLISION,
    Cause.LOW_ROBUSTNESS: Reason.NOT_IN_EQUILIBRIUM,
}
"""Reason by cause of the failure."""


@dataclass(frozen=True)
class InvalidState:
    """A state that is invalid in a scene.

    Attributes:
        index: index of the state in the sequence.
        failure: why it is invalid: of several failures, the first in the order of `Reason`.
    """

    index: int
    failure: Failure

    @property
    def reason(self) -> Reason:
        """Kind of the failure."""
        return REASONS[self.failure.cause]

    @property
    def limb(self) -> str:
        """Name of the limb at fault, "" where it is the root part or no single limb."""
        return self.failure.limb

    @property
    def surface(self) -> str:
        """Id of the lost surface, "" for other reasons."""
        return self.failure.surface

    @property
    def text(self) -> str:
        """The failure in words."""
        return failure_text(self.failure)


class ValidityMonitor:
    """Validates one sequence in one scene after the other. Not thread-safe.

    Args:
        data: the robot with its precomputed data.
        states: states of the sequence.
        threshold: b0 that every state must reach, newtons; 0 where the planner accepted less than
            the request's (`accept_below_threshold`).
        gravity: (3,) gravity in the planning frame, m/s^2.
        grip_force: sum of the contact forces by which b0 without weight is measured, newtons.
        free: a scene in which no state collides, such as the one of the planning; None where none
            is known.

    Attributes:
        states: states of the sequence.

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
        self._bodies = PlacedBodies(data, self.states)
        self._planned = [self._stability.b0(state.contacts, state.com) for state in self.states]
        self._free, self._free_from = free, 0
        """The newest scene in which no state collides, and the index of the first of them."""

    def invalid(self, scene: Scene, first: int = 0) -> tuple[InvalidState, ...]:
        """The invalid states in a scene, in order, one failure each.

        Only the triangles added since the last scene in which no state collided are tested for
        collisions; contacts and equilibrium are always tested.

        Args:
            scene: supporting surfaces and obstacles.
            first: index of the first state to validate.
        """
        found: list[InvalidState] = []
        surfaces: dict[int, Surface | None] = {}  # by contact: neighbours share most of theirs
        collisions = self._collisions(scene, first)
        for i in range(first, len(self.states)):
            state = self.states[i]
            for contact in state.contacts:
                if id(contact) not in surfaces:
                    surfaces[id(contact)] = supporting_surface(
                        scene, contact.points, contact.normal, contact.surface
                    )
            below = [surfaces[id(contact)] for contact in state.contacts]
            failure = (
                self._surface_lost(state, below)
                or self._collision(collisions.get(i))
                or self._low_robustness(i, below)
            )
            if failure is not None:
                found.append(InvalidState(i, failure))
        return tuple(found)

    def _collisions(self, scene: Scene, first: int) -> dict[int, int]:
        """Index of a hull in collision, by index of the state from `first` on."""
        before = self._free if self._free_from <= first else None
        found = self._bodies.collisions(_shapes(scene, before), first)
        # Of the collisions themselves, not of the failures: a lost surface hides a collision there.
        if not found:
            self._free, self._free_from = scene, first
        return found

    def _surface_lost(self, state: State, below: Sequence[Surface | None]) -> Failure | None:
        """The failure of the first contact without a supporting surface."""
        for contact, surface in zip(state.contacts, below, strict=True):
            if surface is None:
                return surface_lost(self._names[contact.limb], contact)
        return None

    def _collision(self, body: int | None) -> Failure | None:
        """The failure of a hull in collision."""
        if body is None:
            return None
        owner = self._bodies.owner[body]
        limb = self._names[owner] if owner >= 0 else ""
        return Failure.of(Cause.BODY_COLLISION, limb, body=self._bodies.names[body])

    def _low_robustness(self, i: int, below: Sequence[Surface | None]) -> Failure | None:
        """The failure of a state whose b0 is too small with the present friction."""
        state, value = self.states[i], self._planned[i]
        frictions = [0.0 if surface is None else surface.friction for surface in below]
        if any(mu != c.friction for mu, c in zip(frictions, state.contacts, strict=True)):
            changed = [
                _with_friction(c, mu) for c, mu in zip(state.contacts, frictions, strict=True)
            ]
            value = self._stability.b0(changed, state.com)
        minimum = self._stability.min_robustness
        if value >= minimum - ROUNDING:
            return None
        return low_robustness(value, minimum, len(state.contacts))


def _shapes(scene: Scene, before: Scene | None) -> Sequence[coal.BVHModelOBBRSS]:
    """Shapes to test: all of a scene, or those added since another scene."""
    if before is None:
        return scene.shapes
    return [mesh_shape(triangles) for triangles in added_triangles(before, scene)]


def _with_friction(contact: Contact, friction: float) -> Contact:
    """The contact with another friction coefficient."""
    rays = np.broadcast_to(cone_generators(contact.rotation, friction), contact.generators.shape)
    return replace(contact, generators=rays, friction=friction)
