"""Collision of the trunk along an edge: no obstacle is missed, and free edges are accepted."""

from __future__ import annotations

import coal
import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rbprm_core.arrays import Array
from rbprm_core.guide.root import EdgeTest, Reachability, RootBounds, RootSpace
from rbprm_core.guide.root.trunk import CLEARANCE, TrunkTest, lever_arms
from rbprm_core.guide.root_space import RootSegment
from rbprm_core.robot.bodies import convex
from rbprm_core.robot.data import RobotData
from rbprm_core.robot.volumes import TrunkPiece
from rbprm_core.scene import Scene
from rbprm_core.scene.triangles import mesh_shape

WIDE = RootBounds(np.full(3, -10.0), np.full(3, 10.0), np.full(3, 4.0))


def at(position: Array, turn: Array | None = None) -> Array:
    rotation = np.eye(3) if turn is None else pin.exp3(turn)
    return np.concatenate([position, pin.Quaternion(rotation).coeffs()])


def plate(point: Array, normal: Array, size: float) -> Array:
    """Two triangles (2, 3, 3) of a square around a point, m."""
    normal = normal / np.linalg.norm(normal)
    u = np.cross(normal, np.eye(3)[int(np.argmin(np.abs(normal)))])
    u /= np.linalg.norm(u)
    v = np.cross(normal, u)
    a, b, c, d = (point + size * (i * u + j * v) for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1)))
    return np.array([[a, b, c], [a, c, d]])


def sampled(test: TrunkTest, a: Array, b: Array, steps: int) -> bool:
    """True where a piece hits at one of some points; cannot prove that an edge is free."""
    return any(test.hits(root) for root in RootSegment(a, b).at_all(np.arange(steps + 1) / steps))


def box_trunk(data: RobotData, half: tuple[float, float, float]) -> list[TrunkPiece]:
    corners = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, 8).T * np.array(half)
    return [TrunkPiece(data.trunk[0].joint, corners)]


@pytest.mark.parametrize("angle", [0.0, 0.3, 0.8])
def test_a_thin_wall_is_not_stepped_over(hyq_data: RobotData, angle: float) -> None:
    """A wall of 1 mm that lies between sampled points of the edge."""
    piece = box_trunk(hyq_data, (0.005, 0.2, 0.1))  # 1 cm long
    normal = np.array([np.cos(angle), np.sin(angle), 0.0])
    low = plate(np.array([0.475, 0, 0.5]), normal, 0.02)
    wall = np.concatenate([low, low + 1e-3 * normal])
    test = TrunkTest(hyq_data.robot, piece, mesh_shape(wall))
    a, b = at(np.array([0.0, 0, 0.5])), at(np.array([1.0, 0, 0.5]))
    assert not sampled(test, a, b, 20)  # 5 cm apart
    assert test.sweep_hits(RootSegment(a, b))
    assert test.sweep_hits(RootSegment(b, a))


def test_a_thin_wall_stops_an_edge(hyq_data: RobotData, flat_scene: Scene) -> None:
    """An edge through a thin wire fails although its ends are valid, for short and long edges."""
    lengths = np.concatenate([p.corners for p in hyq_data.trunk])
    x = float(lengths[:, 0].max()) + 0.024
    wire = plate(np.array([x, 0.0, 0.62]), np.array([0.0, 0.4, 1.0]), 5e-4)
    scene = Scene(flat_scene.surfaces, wire)
    edges = EdgeTest(
        RootSpace(WIDE, np.zeros(0), np.zeros(0)), Reachability(hyq_data, scene, ()), 5
    )
    start = at(np.array([0, 0, 0.62]))
    through = at(np.array([0.025, 0, 0.62]))
    assert not edges.holds(start, through)  # touches in the last millimetre
    assert edges.holds(start, at(np.array([0.02, 0, 0.62])))
    far = at(np.array([2.0, 0, 0.62]))
    assert edges.reachability.holds(start)
    assert edges.reachability.holds(far)
    assert not edges.holds(start, far)


@settings(max_examples=60)
@given(seed=st.integers(0, 2**32 - 1))
def test_a_free_edge_is_free_everywhere(hyq_data: RobotData, seed: int) -> None:
    rng = np.random.default_rng(seed)
    plates = [plate(rng.uniform(-0.6, 0.6, 3), rng.normal(size=3), 0.05) for _ in range(3)]
    test = TrunkTest(hyq_data.robot, hyq_data.trunk, mesh_shape(np.concatenate(plates)))
    a, b = (at(rng.uniform(-0.7, 0.7, 3), rng.uniform(-1, 1, 3)) for _ in range(2))
    hits = test.sweep_hits(RootSegment(a, b))
    assert hits or not sampled(test, a, b, 300)
    if hits:  # a refused edge comes near the mesh at least
        assert min_distance(hyq_data, np.concatenate(plates), a, b) < 4 * CLEARANCE + 5e-3


def min_distance(data: RobotData, triangles: Array, a: Array, b: Array) -> float:
    mesh, shape = mesh_shape(triangles), convex(data.trunk[0].corners)
    found = []
    for root in RootSegment(a, b).at_all(np.arange(301) / 300):
        place = coal.Transform3s(pin.Quaternion(root[3:7]).matrix(), root[:3])
        request, result = coal.DistanceRequest(), coal.DistanceResult()
        found.append(coal.distance(shape, place, mesh, coal.Transform3s(), request, result))
    return float(min(found))


def test_standing_still_is_a_test_of_one_point(hyq_data: RobotData, flat_scene: Scene) -> None:
    test = TrunkTest(hyq_data.robot, hyq_data.trunk, flat_scene.shape)
    above, inside = at(np.array([0, 0, 0.6])), at(np.array([0, 0, 0.0]))
    assert not test.sweep_hits(RootSegment(above, above))
    assert test.sweep_hits(RootSegment(inside, inside))


def test_no_trunk_hits_nothing(hyq_data: RobotData, flat_scene: Scene) -> None:
    test = TrunkTest(hyq_data.robot, [], flat_scene.shape)
    a, b = at(np.array([0, 0, 0.5])), at(np.array([0, 0, -0.5]))
    assert test.radius == 0.0
    assert not test.hits(a)
    assert not test.sweep_hits(RootSegment(a, b))


@settings(max_examples=40)
@given(seed=st.integers(0, 2**32 - 1))
def test_a_body_moves_no_farther_than_its_lever_arms_allow(toy_data: RobotData, seed: int) -> None:
    """For rotations of the root and motions of the joint planned with it."""
    rng = np.random.default_rng(seed)
    robot, joint = toy_data.robot, toy_data.robot.root_joints[0]
    corners = rng.uniform(-0.3, 0.3, (6, 3))
    bound = lever_arms(robot, joint, corners)
    placed = []
    roots = []
    for _ in range(2):
        turn, waist = rng.uniform(-1, 1, 3), rng.uniform(-0.4, 0.4, 1)
        root = np.concatenate([at(rng.uniform(-1, 1, 3), turn), waist])
        q = robot.reference.copy()
        q[robot.root_index] = root
        data = robot.model.createData()
        pin.forwardKinematics(robot.model, data, q)
        placed.append(corners @ data.oMi[joint].rotation.T + data.oMi[joint].translation)
        roots.append(root)
    a, b = roots
    angle = pin.Quaternion(a[3:7]).angularDistance(pin.Quaternion(b[3:7]))
    limit = np.linalg.norm(b[:3] - a[:3]) + bound @ np.array([angle, abs(b[7] - a[7])])
    assert np.linalg.norm(placed[1] - placed[0], axis=1).max() <= limit + 1e-9
    assert np.linalg.norm(placed[0] - a[:3], axis=1).max() <= bound[0] + 1e-9
