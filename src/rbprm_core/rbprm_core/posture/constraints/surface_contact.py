"""A contact anywhere on a convex polygon (Escande et al. 2013, equations 14 to 17, 23 and 24)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from rbprm_core.arrays import Array
from rbprm_core.body.contact import Contact
from rbprm_core.failures import Cause, Failure
from rbprm_core.posture.constraints.rows import ByRows, Rows
from rbprm_core.posture.kinematics import Kinematics, cross
from rbprm_core.robot import Robot
from rbprm_core.scene import Surface
from rbprm_core.statics import cone_generators


@dataclass(frozen=True, eq=False)
class SurfaceContact:
    """A contact of a limb anywhere on a convex piece of a surface.

    Attributes:
        limb: index of the limb.
        surface: the surface.
        piece: index of the convex piece of its polygon.
        edge_margin: smallest distance of the contact's points from the edges of the piece, metres.
        spot: index of the limb's contact spot.
    """

    limb: int
    surface: Surface
    piece: int = 0
    edge_margin: float = 0.01
    spot: int = 0


class ContactOnSurface(ByRows):
    """The contact frame of a limb lies on a convex piece of a surface, its place left free.

    Args:
        robot: the robot.
        contact: the limb, and where its contact may be.
    """

    tolerance = 1e-5
    """Metres; an error of a radian counts as a metre."""

    def __init__(self, robot: Robot, contact: SurfaceContact) -> None:
        surface = contact.surface
        self._limb, self._index = robot.limbs[contact.limb], contact.limb
        self._spot_index, self._surface = contact.spot, surface
        self._spot = self._limb.spots[contact.spot]
        self._normal = surface.normal
        ring = surface.polygon.pieces[contact.piece]
        edges = np.roll(ring, -1, axis=0) - ring
        inward = np.cross(self._normal, edges)
        self._inward = inward / np.linalg.norm(inward, axis=1)[:, None]
        self._offsets = np.einsum("ij,ij->i", self._inward, ring) + contact.edge_margin
        self._height = float(self._normal @ surface.polygon.plane.origin) + self._spot.radius

    def rows(self, kinematics: Kinematics) -> Rows:
        """See `Constraint.rows`."""
        frame, jacobian = kinematics.spot(self._spot)
        normal = self._normal
        matrix = [normal @ jacobian[:3]]
        lower = [self._height - float(normal @ frame.translation)]
        upper = list(lower)
        axis = frame.rotation[:, 2]
        if self._spot.planar:
            # Rotate the frame's z axis onto the normal: two tangential components of the error.
            error = cross(axis, normal) if axis @ normal > 0 else _half_turn(axis, normal)
            for tangent in self._surface.polygon.plane.axes.T:
                matrix.append(tangent @ jacobian[3:])
                lower.append(float(tangent @ error))
                upper.append(float(tangent @ error))
        elif self._spot.min_cosine > -1.0:
            matrix.append(cross(axis, normal) @ jacobian[3:])
            lower.append(self._spot.min_cosine - float(axis @ normal))
            upper.append(np.inf)
        for corner in self._spot.corners:
            arm = frame.rotation @ corner
            moving = jacobian[:3] - pin.skew(arm) @ jacobian[3:]
            inside = self._inward @ (frame.translation + arm)
            matrix.extend(self._inward @ moving)
            lower.extend((self._offsets - inside).tolist())
            upper.extend([np.inf] * len(inside))
        return Rows(np.array(matrix), np.array(lower), np.array(upper))

    def failure(self, violation: float) -> Failure:
        """See `Constraint.failure`."""
        return Failure.of(
            Cause.CONTACT_NOT_REACHED,
            self._limb.name,
            surface=self._surface.id,
            distance=violation,
        )

    def contact(self, kinematics: Kinematics) -> Contact:
        """The contact of the limb at a configuration that satisfies this constraint.

        Args:
            kinematics: the robot at the configuration.
        """
        frame, _ = kinematics.spot(self._spot)
        plane, normal = self._surface.polygon.plane, self._normal
        position = frame.translation - self._spot.radius * normal
        position = position - float(normal @ (position - plane.origin)) * normal
        rotation = np.column_stack([plane.axes, normal])
        if self._spot.planar:
            turn = pin.Quaternion.FromTwoVectors(frame.rotation[:, 2], normal).matrix()
            rotation = turn @ frame.rotation
        points = position + self._spot.corners @ rotation.T
        rays = np.broadcast_to(
            cone_generators(rotation, self._surface.friction), (len(points), 4, 3)
        )
        friction, surface = self._surface.friction, self._surface.id
        return Contact(
            self._index, position, rotation, points, rays, friction, surface, self._spot_index
        )


def _half_turn(axis: Array, normal: Array) -> Array:
    """Rotation vector (3,) of at least a quarter turn from an axis to a normal."""
    turn = cross(axis, normal)
    size = float(np.linalg.norm(turn))
    if size < 1e-9:
        return np.array([np.pi, 0.0, 0.0])
    return turn / size * float(np.arccos(np.clip(axis @ normal, -1.0, 1.0)))
