"""Collision bodies of the robot: convex hulls where these suffice, else the URDF's meshes.

A hull contains its link, so "hulls apart" proves "links apart". Between links whose hulls overlap
while the links do not (a thigh in the hollow of a trunk) the meshes themselves are tested.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import coal
import numpy as np
import pinocchio as pin

from rbprm_core.arrays import Array, BoolArray, IntArray
from rbprm_core.robot.model import Robot

EXACT_PAIR_SAMPLES = 400


@dataclass(frozen=True, eq=False)
class Bodies:
    """The robot's geometry objects and the pairs of them to test for self-collision.

    The root part consists of the links that move with the root alone or with a joint planned with
    it.

    Attributes:
        objects: (o,) convex hulls (or the URDF's primitives), then the meshes of links that have
            one; their placements are in the frames of their joints.
        hulls: number of leading objects that are convex; object i < hulls is geometry i of the
            URDF.
        self_pairs: (p, 2) indices into `objects`, each pair in the cheapest form that is exact.
        owner: (o,) index of the limb that the object belongs to, -1 for the root part.
        group: (o,) id of the joint that the object is fixed to: the root's, one planned with it,
            or a limb's; all other joints keep their reference position.
        last: (o,) True where the object is fixed to its limb's last joint.
    """

    objects: tuple[pin.GeometryObject, ...]
    hulls: int
    self_pairs: IntArray
    owner: IntArray
    group: IntArray
    last: BoolArray

    def model(self, pairs: Iterable[tuple[int, int]]) -> pin.GeometryModel:
        """A geometry model of all objects that tests some pairs.

        Args:
            pairs: pairs of indices into `objects`.
        """
        geometry = pin.GeometryModel()
        for body in self.objects:
            geometry.addGeometryObject(body)
        for first, second in pairs:
            geometry.addCollisionPair(pin.CollisionPair(int(first), int(second)))
        return geometry

    def pairs_between(self, limb: int, other: int) -> list[tuple[int, int]]:
        """Self-collision pairs between two limbs, as indices into `objects`.

        Args:
            limb: index of one limb, or -1 for the root part.
            other: index of the other limb, or -1 for the root part.
        """
        owners = self.owner[self.self_pairs]
        chosen = (np.sort(owners, axis=1) == sorted((limb, other))).all(axis=1)
        return [(int(first), int(second)) for first, second in self.self_pairs[chosen]]

    def limb_pairs(self, limb: int) -> list[tuple[int, int]]:
        """Self-collision pairs of a limb with itself and the root part, indices into `objects`.

        Args:
            limb: index of the limb, or -1 for the root part.
        """
        owners = self.owner[self.self_pairs]
        chosen = (owners == limb).any(axis=1) & np.isin(owners, (limb, -1)).all(axis=1)
        groups = self.group[self.self_pairs]
        chosen &= groups[:, 0] != groups[:, 1]  # or they never move against each other
        return [(int(first), int(second)) for first, second in self.self_pairs[chosen]]


def make_bodies(robot: Robot, exact: BoolArray) -> Bodies:
    """The collision bodies of a robot.

    Args:
        robot: the robot.
        exact: (p,) True for the pairs of the robot's geometry whose meshes must be tested.
    """
    raw = list(robot.geometry.geometryObjects)
    objects = [_hull_object(body) for body in raw]
    mesh_index = {}
    for i, body in enumerate(raw):
        if isinstance(body.geometry, coal.BVHModelBase):
            mesh_index[i] = len(objects)
            objects.append(pin.GeometryObject(body))
    pairs = [(pair.first, pair.second) for pair in robot.geometry.collisionPairs]
    chosen = [
        (mesh_index.get(a, a), mesh_index.get(b, b)) if with_meshes else (a, b)
        for (a, b), with_meshes in zip(pairs, exact, strict=True)
    ]
    joints = [body.parentJoint for body in objects]
    ends = {limb.last_joint for limb in robot.limbs}
    group = [robot.fixed_to(joint) for joint in joints]
    return Bodies(
        objects=tuple(objects),
        hulls=len(raw),
        self_pairs=np.array(chosen, dtype=int).reshape(-1, 2),
        owner=np.array([_owner(robot, joint) for joint in group]),
        group=np.array(group),
        last=np.array([joint in ends for joint in group]),
    )


def _owner(robot: Robot, joint: int) -> int:
    """Index of the limb that a joint belongs to, -1 for a joint of the root part."""
    return next((k for k, limb in enumerate(robot.limbs) if joint in limb.joints), -1)


def find_exact_pairs(
    robot: Robot,
    rng: np.random.Generator,
    poll: Callable[[], None] = lambda: None,
) -> BoolArray:
    """Mask of the pairs whose hulls collide in a posture where their meshes do not.

    The reference posture and random postures inside the joint limits are tried.

    Args:
        robot: the robot.
        rng: source of the random postures.
        poll: function called at every posture; may raise to stop.

    Returns:
        (p,) True for the pairs of the robot's geometry whose meshes must be tested.
    """
    count = len(robot.geometry.collisionPairs)
    bounds = np.isfinite(robot.low) & np.isfinite(robot.high)
    hulls = make_bodies(robot, np.zeros(count, dtype=bool))
    hull_test = pair_test(robot, hulls.model(hulls.self_pairs))
    mesh_test = pair_test(robot, robot.geometry)
    exact = np.zeros(count, dtype=bool)
    for i in range(EXACT_PAIR_SAMPLES):
        poll()
        q = robot.reference.copy()
        if i > 0:
            q[bounds] = rng.uniform(robot.low[bounds], robot.high[bounds])
        exact |= hull_test(q) & ~mesh_test(q)
    return exact


def pair_test(robot: Robot, geometry: pin.GeometryModel) -> Callable[[Array], BoolArray]:
    """A function that maps a configuration to the mask of the pairs in collision.

    Args:
        robot: the robot.
        geometry: geometry model of the robot, with p pairs.

    Returns:
        Function of a configuration (nq,); its values are (p,), True where a pair collides.
    """
    data, scratch = robot.model.createData(), geometry.createData()

    def collide(q: Array) -> BoolArray:
        pin.computeCollisions(robot.model, data, geometry, scratch, q, False)
        return np.array([result.isCollision() for result in scratch.collisionResults], dtype=bool)

    return collide


def _hull_object(body: pin.GeometryObject) -> pin.GeometryObject:
    """A copy of an object, its mesh replaced by the mesh's convex hull; a primitive stays."""
    hull = pin.GeometryObject(body)
    if isinstance(body.geometry, coal.BVHModelBase):
        body.geometry.buildConvexHull(True, "Qt")
        hull.geometry = body.geometry.convex
    return hull


def convex(vertices: Array) -> coal.ShapeBase:
    """The convex hull of some points as a coal shape.

    Args:
        vertices: (n, 3) points, metres.
    """
    points = coal.StdVec_Vec3s()
    for vertex in vertices:
        points.append(vertex)
    return coal.Convex.convexHull(points, True, "Qt")
