"""Random root configurations near surfaces, where contact is possible.

Tonneau et al. 2018, section 3.3.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation

from rbprm_core.arrays import Array, BoolArray
from rbprm_core.guide.root.reachability import Reachability
from rbprm_core.guide.root_space import RootSpace
from rbprm_core.robot.data import RobotData
from rbprm_core.scene import Scene
from rbprm_core.surface_kind import SurfaceKind

AREA_WEIGHTED = 0.3  # share of samples whose surface is drawn by area; the rest draw evenly
HEIGHTS = (0.6, 1.15)  # range of the root's height over its surface, in reference heights
TRIES = 48
BATCH = 8  # candidates drawn at once: a single one would take nearly as long
AT_REFERENCE = 0.5  # share of samples whose root joints stay at the reference posture


class RootSampler:
    """Draws root configurations over random points of random surfaces, valid and within bounds.

    Args:
        space: bounds of the root and of the joints planned with it.
        scene: scene with the surfaces.
        reachability: reachability condition in the scene.
        height: height of the root over its contacts in the reference posture, m.
        joints: (j,) joints planned with the root in the reference posture, rad or m.
        effectors: (n, 3) positions of effectors in the root's frame, m, for planning without
            gravity, where a surface has no upper side. A sampled root then has one effector on a
            surface of any kind. None with gravity.
    """

    def __init__(
        self,
        space: RootSpace,
        scene: Scene,
        reachability: Reachability,
        height: float,
        joints: Array,
        effectors: Array | None = None,
    ) -> None:
        self._space, self._reachability = space, reachability
        self._height, self._joints, self._effectors = height, joints, effectors
        support = SurfaceKind.SUPPORT
        surfaces = [s for s in scene.surfaces if effectors is not None or s.kind is support]
        fans = [
            (piece[0], piece[i], piece[i + 1], s.normal)
            for s in surfaces
            for piece in s.polygon.pieces
            for i in range(1, len(piece) - 1)
        ]
        triangles = np.array([f[:3] for f in fans]).reshape(-1, 3, 3)
        normals = np.array([f[3] for f in fans]).reshape(-1, 3)
        if effectors is None:
            distances = HEIGHTS[1] * height * np.abs(normals)
        else:
            distances = np.full_like(normals, np.linalg.norm(effectors, axis=1).max())
        near = self._near_bounds(triangles, distances)
        if near.any():  # otherwise no sample is within bounds, and the search reports a failure
            triangles, normals = triangles[near], normals[near]
        self._triangles, self._normals = triangles, normals
        sides = self._triangles[:, 1:] - self._triangles[:, :1]
        areas = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
        self._cumulative = np.cumsum(areas / areas.sum()) if len(areas) else areas

    def _near_bounds(self, triangles: Array, distances: Array) -> BoolArray:
        """(n,) True for triangles over which a root may be within bounds.

        Triangles far from the bounds would waste samples.

        Args:
            triangles: (n, 3, 3) corners, m.
            distances: (n, 3) largest distance of a root from each triangle by axis, m.
        """
        bounds = self._space.bounds
        low, high = triangles.min(axis=1) - distances, triangles.max(axis=1) + distances
        return np.asarray(((high >= bounds.low) & (low <= bounds.high)).all(axis=1))

    def draw(self, rng: np.random.Generator) -> Array | None:
        """Valid root configuration (7 + j,); None where `TRIES` candidates were all invalid.

        Args:
            rng: source of random numbers.
        """
        for _ in range(TRIES // BATCH):
            for root in self.candidates(rng, BATCH):
                if self._space.contains(root) and self._reachability.holds(root):
                    return np.asarray(root)
        return None

    def candidates(self, rng: np.random.Generator, count: int) -> Array:
        """Root configurations (count, 7 + j) before their test for validity.

        Args:
            rng: source of random numbers.
            count: number of root configurations.
        """
        bounds, joints = self._space.bounds, self._joints
        yaw, pitch, roll = rng.uniform(-bounds.half_ranges, bounds.half_ranges, (count, 3)).T
        orientations = _quaternions(yaw, pitch, roll)
        postures = np.tile(joints, (count, 1))
        if len(joints):
            drawn = rng.uniform(self._space.joint_low, self._space.joint_high, postures.shape)
            away = rng.random(count) >= AT_REFERENCE
            postures[away] = drawn[away]
        if len(self._triangles) == 0:
            positions = rng.uniform(bounds.low, bounds.high, (count, 3))
        else:
            positions = self._at_surfaces(orientations, rng)
        return np.concatenate([positions, orientations, postures], axis=1)

    def _at_surfaces(self, orientations: Array, rng: np.random.Generator) -> Array:
        """Positions (n, 3) over random points of random surfaces, or with an effector on them."""
        count = len(orientations)
        by_area = np.searchsorted(self._cumulative, rng.random(count))
        evenly = rng.integers(len(self._triangles), size=count)
        chosen = np.where(rng.random(count) < AREA_WEIGHTED, by_area, evenly)
        chosen = np.minimum(chosen, len(self._triangles) - 1)
        a, b, c = np.swapaxes(self._triangles[chosen], 0, 1)
        u, v = rng.random((2, count, 1))
        u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
        points = a + u * (b - a) + v * (c - a)
        if self._effectors is not None:
            touching = self._effectors[rng.integers(len(self._effectors), size=count)]
            return np.asarray(points - Rotation.from_quat(orientations).apply(touching))
        heights = self._height * rng.uniform(*HEIGHTS, (count, 1))
        return np.asarray(points + heights * self._normals[chosen])


def _quaternions(yaw: Array, pitch: Array, roll: Array) -> Array:
    """Unit quaternions (n, 4) of intrinsic rotations about z, y and x."""
    angles = np.stack([yaw, pitch, roll], axis=1)
    return np.asarray(Rotation.from_euler("ZYX", angles).as_quat())


def effector_places(data: RobotData) -> Array:
    """Effector positions (n, 3) in metres of all limb samples, in the root's frame.

    Joints planned with the root are at the reference posture.

    Args:
        data: robot with its limb samples.
    """
    robot = data.robot
    scratch = robot.model.createData()
    pin.forwardKinematics(robot.model, scratch, robot.reference)
    places = []
    for limb, database in zip(robot.limbs, data.databases, strict=True):
        base = scratch.oMi[limb.base]
        places.append(database.positions @ base.rotation.T + base.translation)
    return np.concatenate(places)
