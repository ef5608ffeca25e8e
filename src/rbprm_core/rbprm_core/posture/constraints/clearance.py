"""Distances between bodies, and between bodies and the environment, kept above a margin.

Escande et al. 2013, equations 5b, 5c and 19, linearised at the nearest points of each pair.
"""

from __future__ import annotations

from collections.abc import Iterable

import coal
import numpy as np
import pinocchio as pin

from rbprm_core.arrays import Array
from rbprm_core.body.collision import LIFT
from rbprm_core.body.contact import Contact
from rbprm_core.failures import Cause, Failure
from rbprm_core.posture.constraints.rows import Rows
from rbprm_core.posture.kinematics import Kinematics
from rbprm_core.robot.data import RobotData
from rbprm_core.scene import Scene

MAX_FEATURES = 8  # contact points of one pair that get a row
STANDING_MARGIN = 3e-4
"""Metres that a limb in contact keeps from the environment, after it is lifted off its surface."""


class Clearance:
    """No pair of bodies is nearer than a margin.

    Pairs are found by `collide` with a security margin, which returns all near features of a pair
    and not the nearest one only: of a standing limb the nearest is the ground.

    Args:
        data: the robot with its collision bodies.
        scene: the environment.
        contacts: contacts whose limbs touch the environment.
        margin: smallest distance, metres.
        reach: distance up to which features get a row, metres.
    """

    tolerance = 1e-4

    def __init__(
        self,
        data: RobotData,
        scene: Scene,
        contacts: Iterable[Contact],
        margin: float,
        reach: float = 0.03,
    ) -> None:
        bodies = data.bodies
        self._objects, self._hulls = bodies.objects, bodies.hulls
        self._owner, self._last = bodies.owner, bodies.last
        self._pairs = [(int(i), int(j)) for i, j in bodies.self_pairs]
        self._shapes, self._margin, self._reach = scene.shapes, margin, reach
        self._names = [limb.name for limb in data.robot.limbs]
        self._normals = {contact.limb: contact.normal for contact in contacts}
        self._request = coal.CollisionRequest()
        self._request.enable_contact = True
        self._request.num_max_contacts = MAX_FEATURES
        self._request.security_margin = reach
        self._identity = coal.Transform3s()
        for shape in (*(body.geometry for body in self._objects), *self._shapes):
            shape.computeLocalAABB()
        self._worst = ("", "")

    def rows(self, kinematics: Kinematics) -> Rows:
        """See `Constraint.rows`."""
        size = kinematics.robot.model.nv
        places = [self._placement(kinematics, i) for i in range(len(self._objects))]
        boxes = [self._box(i, place) for i, place in enumerate(places)]
        matrix: list[Array] = []
        lower: list[float] = []
        worst = np.inf
        for i in range(self._hulls):
            margin, place = self._against_environment(i, places[i])
            for shape in self._shapes:
                if not _near(boxes[i], _shape_box(shape), self._reach):
                    continue
                for contact in self._features(self._objects[i].geometry, place, shape, None):
                    normal, near, far, gap = contact
                    jacobian = self._point_jacobian(kinematics, i, near)
                    matrix.append(-normal @ jacobian)
                    lower.append(margin - gap)
                    if gap - margin < worst:
                        worst, self._worst = gap - margin, (self._objects[i].name, "")
        for i, j in self._pairs:
            if not _near(boxes[i], boxes[j], self._reach):
                continue
            for normal, near, far, gap in self._features(
                self._objects[i].geometry, places[i], self._objects[j].geometry, places[j]
            ):
                first = self._point_jacobian(kinematics, i, near)
                second = self._point_jacobian(kinematics, j, far)
                matrix.append(normal @ (second - first))
                lower.append(self._margin - gap)
                if gap - self._margin < worst:
                    worst = gap - self._margin
                    self._worst = (self._objects[i].name, self._objects[j].name)
        if not matrix:
            return Rows(np.zeros((0, size)), np.zeros(0), np.zeros(0))
        return Rows(np.array(matrix), np.array(lower), np.full(len(lower), np.inf))

    def failure(self, violation: float) -> Failure:
        """See `Constraint.failure`."""
        first, second = self._worst
        owner = next((k for k, o in enumerate(self._objects) if o.name == first), -1)
        limb = self._names[self._owner[owner]] if owner >= 0 and self._owner[owner] >= 0 else ""
        if second:
            return Failure.of(Cause.SELF_COLLISION, limb, body=f"{first} and {second}")
        return Failure.of(Cause.BODY_COLLISION, limb, body=first)

    def _against_environment(self, i: int, place: pin.SE3) -> tuple[float, pin.SE3]:
        """Margin and placement of a body against the environment; a link in contact is lifted."""
        normal = self._normals.get(int(self._owner[i])) if self._last[i] else None
        if normal is None:
            return self._margin, place
        return STANDING_MARGIN, pin.SE3(place.rotation, place.translation + LIFT * normal)

    def _placement(self, kinematics: Kinematics, i: int) -> pin.SE3:
        body = self._objects[i]
        return kinematics.data.oMi[body.parentJoint] * body.placement

    def _box(self, i: int, place: pin.SE3) -> tuple[Array, Array]:
        box = self._objects[i].geometry.aabb_local
        low, high = np.array(box.min_), np.array(box.max_)
        middle = place.act((low + high) / 2)
        extent = np.abs(place.rotation) @ ((high - low) / 2)
        return middle - extent, middle + extent

    def _features(
        self,
        first: coal.CollisionGeometry,
        place: pin.SE3,
        second: coal.CollisionGeometry,
        other: pin.SE3 | None,
    ) -> list[tuple[Array, Array, Array, float]]:
        """Normal from the first to the second body, their near points, and the gap, of features."""
        result = coal.CollisionResult()
        pose = coal.Transform3s(place.rotation, place.translation)
        where = (
            self._identity if other is None else coal.Transform3s(other.rotation, other.translation)
        )
        coal.collide(first, pose, second, where, self._request, result)
        found = []
        for contact in result.getContacts():
            normal = np.asarray(contact.normal)
            found.append(
                (
                    normal,
                    np.asarray(contact.getNearestPoint1()),
                    np.asarray(contact.getNearestPoint2()),
                    float(contact.penetration_depth),
                )
            )
        return found

    def _point_jacobian(self, kinematics: Kinematics, i: int, point: Array) -> Array:
        """Jacobian (3, nv) of a point fixed to a body."""
        joint = self._objects[i].parentJoint
        jacobian = kinematics.joint_jacobian(joint)
        x, y, z = point - kinematics.joint_position(joint)
        skew = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        return np.asarray(jacobian[:3] - skew @ jacobian[3:])


def _near(first: tuple[Array, Array], second: tuple[Array, Array], reach: float) -> bool:
    return bool((first[0] <= second[1] + reach).all() and (first[1] >= second[0] - reach).all())


def _shape_box(shape: coal.CollisionGeometry) -> tuple[Array, Array]:
    box = shape.aabb_local
    return np.array(box.min_), np.array(box.max_)
