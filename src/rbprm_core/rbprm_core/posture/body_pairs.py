"""Collision tests and near features of a whole robot: its bodies and the environment."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from rbprm_core.arrays import Array, BoolArray, IntArray
from rbprm_core.body.broadphase import PairGroup
from rbprm_core.body.collision import LIFT
from rbprm_core.robot import Robot
from rbprm_core.robot.data import RobotData
from rbprm_core.scene import Scene

ENVIRONMENT = -1
"""Stands for the environment where a body has an index."""
MAX_FEATURES = 32
"""Largest number of features of a pair: a body and a mesh have one for each near triangle."""

FEW_BODIES = 24
"""Number of bodies up to which all are tested without comparing boxes first, which costs more."""


@dataclass(frozen=True, eq=False)
class Features:
    """Features of pairs of bodies that are nearer than some reach.

    Attributes:
        first: (m,) index of the first body of each feature's pair.
        second: (m,) index of the second body, `ENVIRONMENT` for the environment.
        normals: (m, 3) unit vectors from the first to the second body, in the planning frame.
        points: (m, 3) nearest point of the first body, metres.
        gaps: (m,) distance, metres; negative where the bodies overlap.
    """

    first: IntArray
    second: IntArray
    normals: Array
    points: Array
    gaps: Array


class BodyPairs:
    """All pairs of bodies that can collide. Not thread-safe: it holds scratch data.

    The environment is one mesh: tests against it take a tenth of the time of tests against several
    meshes whose boxes overlap. Only bodies whose boxes are near that of a triangle are tested.
    Features are found by coal's collision test with a security margin, which returns those of all
    near triangles; a distance would return the nearest one only, which for a limb in contact is on
    its surface.

    Args:
        data: the robot with its collision bodies.
        scene: the environment.
        reach: distance up to which features are found, metres.

    Attributes:
        names: names of the bodies.
        joints: (o,) id of the joint that each body is fixed to.
        moving: (o, nv) True for the coordinates that move each body.
    """

    def __init__(self, data: RobotData, scene: Scene, reach: float) -> None:
        bodies, model = data.bodies, data.robot.model
        self._model, self._reach = model, reach
        self.names = [body.name for body in bodies.objects]
        self.joints: IntArray = np.array([body.parentJoint for body in bodies.objects], dtype=int)
        self.moving = _supports(data.robot)[self.joints]
        groups = bodies.group[bodies.self_pairs]
        self._pairs: IntArray = bodies.self_pairs[groups[:, 0] != groups[:, 1]]
        self._first, self._second = np.ascontiguousarray(self._pairs.T)
        pairs = [(int(first), int(second)) for first, second in self._pairs]
        self._ends = [
            np.flatnonzero(bodies.last & (bodies.owner == k)).tolist()
            for k in range(len(data.robot.limbs))
        ]
        self._hulls = bodies.hulls
        self._overlap = PairGroup(model, bodies.objects, pairs)
        self._itself = bodies.model(pairs)
        self._environment = pin.GeometryModel()
        for body in bodies.objects[: bodies.hulls]:
            self._environment.addGeometryObject(body)
        place = pin.SE3.Identity()
        obstacle = self._environment.addGeometryObject(
            pin.GeometryObject("environment", 0, place, scene.shape)
        )
        for i in range(bodies.hulls):
            self._environment.addCollisionPair(pin.CollisionPair(i, obstacle))
        self._touching = _data(self._environment, 0.0, 1)
        self._near_environment = _data(self._environment, reach, MAX_FEATURES)
        self._near_itself = _data(self._itself, reach, MAX_FEATURES)
        self._used_joints = sorted(set(self.joints.tolist()))
        self._joint_index = np.searchsorted(self._used_joints, self.joints)
        self._centers, self._extents, self._rotations = _boxes(bodies.objects)
        low, high = scene.triangles.min(axis=1), scene.triangles.max(axis=1)
        self._triangles = np.ascontiguousarray(np.hstack([low, -high]).T)

    def collide(self, data: pin.Data, normals: Mapping[int, Array]) -> bool:
        """True where any pair collides.

        Args:
            data: data of the robot's model, forward kinematics done.
            normals: normal (3,) of the touched surface, by index of the limb in contact; the last
                link of such a limb is lifted before it is compared with the environment.
        """
        if self._overlap.collides(data):
            return True
        self._place_in_environment(data, self._touching, normals)
        if self._hulls <= FEW_BODIES:
            return bool(pin.computeCollisions(self._environment, self._touching, True))
        return any(
            pin.computeCollision(self._environment, self._touching, i)
            for i in self._near_triangles(*self._world_boxes(data), LIFT)
        )

    def near(self, data: pin.Data, normals: Mapping[int, Array]) -> Features:
        """The features of all pairs nearer than the reach.

        Args:
            data: data of the robot's model, forward kinematics done.
            normals: as in `collide`.
        """
        self._place_in_environment(data, self._near_environment, normals)
        middles, halves = self._world_boxes(data)
        found = []
        for i in self._near_triangles(middles, halves, self._reach + LIFT):
            if pin.computeCollision(self._environment, self._near_environment, i):
                result = self._near_environment.collisionResults[i]
                found += [(i, ENVIRONMENT, contact) for contact in _contacts(result)]
        pin.updateGeometryPlacements(self._model, data, self._itself, self._near_itself)
        for k in self._near_pairs(middles, halves):
            if pin.computeCollision(self._itself, self._near_itself, k):
                first, second = self._pairs[k]
                result = self._near_itself.collisionResults[k]
                found += [(int(first), int(second), contact) for contact in _contacts(result)]
        contacts = [contact for _, _, contact in found]
        return Features(
            first=np.array([first for first, _, _ in found], dtype=int),
            second=np.array([second for _, second, _ in found], dtype=int),
            normals=np.array([contact.normal for contact in contacts]).reshape(-1, 3),
            points=np.array([c.getNearestPoint1() for c in contacts]).reshape(-1, 3),
            gaps=np.array([contact.penetration_depth for contact in contacts]),
        )

    def _place_in_environment(
        self, data: pin.Data, geometry: pin.GeometryData, normals: Mapping[int, Array]
    ) -> None:
        pin.updateGeometryPlacements(self._model, data, self._environment, geometry)
        for limb, normal in normals.items():
            for body in self._ends[limb]:
                if body < self._hulls:
                    geometry.oMg[body].translation += LIFT * normal

    def _world_boxes(self, data: pin.Data) -> tuple[Array, Array]:
        """Middles (o, 3) and half sides (o, 3) of the bodies' boxes, aligned with the axes."""
        places = [data.oMi[joint] for joint in self._used_joints]
        rotations = np.array([place.rotation for place in places])[self._joint_index]
        origins = np.array([place.translation for place in places])[self._joint_index]
        middles = origins + (rotations @ self._centers)[:, :, 0]
        return middles, (np.abs(rotations @ self._rotations) @ self._extents)[:, :, 0]

    def _near_triangles(self, middles: Array, halves: Array, reach: float) -> list[int]:
        """Indices of the bodies whose boxes are near the box of a triangle."""
        hulls = slice(self._hulls)
        bounds = np.concatenate([middles[hulls] + halves[hulls], halves[hulls] - middles[hulls]], 1)
        bounds = np.ascontiguousarray(bounds.T) + reach
        # Triangles near the robot first: they are few in a large scene.
        about = (self._triangles <= bounds.max(axis=1)[:, None]).all(axis=0)
        near = np.ones((self._hulls, int(about.sum())), dtype=bool)
        for triangles, bodies in zip(self._triangles[:, about], bounds, strict=True):
            near &= triangles <= bodies[:, None]
        return [int(i) for i in np.flatnonzero(near.any(axis=1))]

    def _near_pairs(self, middles: Array, halves: Array) -> list[int]:
        """Indices of the robot's own pairs whose boxes are near."""
        near = np.ones(len(self._first), dtype=bool)
        for middle, half in zip(middles.T, halves.T, strict=True):
            distances = np.abs(middle[self._first] - middle[self._second])
            near &= distances <= half[self._first] + half[self._second] + self._reach
        return [int(k) for k in np.flatnonzero(near)]


def _data(geometry: pin.GeometryModel, margin: float, features: int) -> pin.GeometryData:
    """Data of a geometry model whose tests return features up to a distance."""
    data = geometry.createData()
    for request in data.collisionRequests:
        # Without contacts coal gives up on some pairs that are millimetres deep in each other.
        request.enable_contact = True
        request.num_max_contacts = features
        request.security_margin = margin
        # A guess from the last test would make distances depend on it, in the seventh digit.
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)
            request.enable_cached_gjk_guess = False
    return data


def _contacts(result: pin.coal.CollisionResult) -> list[pin.coal.Contact]:
    return [result.getContact(i) for i in range(result.numContacts())]


def _boxes(objects: tuple[pin.GeometryObject, ...]) -> tuple[Array, Array, Array]:
    """Middles (o, 3, 1) in the joints' frames, half sides (o, 3, 1), rotations (o, 3, 3)."""
    middles, halves = [], []
    for body in objects:
        body.geometry.computeLocalAABB()
        box = body.geometry.aabb_local
        low, high = np.array(box.min_), np.array(box.max_)
        middles.append(body.placement.act((low + high) / 2))
        halves.append((high - low) / 2)
    rotations = np.array([body.placement.rotation for body in objects])
    return np.array(middles)[:, :, None], np.array(halves)[:, :, None], rotations


def _supports(robot: Robot) -> BoolArray:
    """Mask (njoints, nv): the coordinates that move each joint."""
    model = robot.model
    supports = np.zeros((model.njoints, model.nv), dtype=bool)
    for joint in range(1, model.njoints):
        first, count = model.joints[joint].idx_v, model.joints[joint].nv
        supports[joint] = supports[model.parents[joint]]
        supports[joint, first : first + count] = True
    return supports
