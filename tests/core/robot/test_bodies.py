"""Collision bodies: hulls that contain their links, and meshes where hulls do not suffice."""

from __future__ import annotations

import coal
import numpy as np
import pinocchio as pin
import pytest

from rbprm_core.arrays import Array
from rbprm_core.robot import Robot
from rbprm_core.robot.bodies import Bodies, convex, find_exact_pairs, make_bodies, pair_test
from rbprm_core.robot.data import RobotData
from rbprm_core.robot.model import ROOT_JOINT


def random_configuration(robot: Robot, rng: np.random.Generator) -> Array:
    q = robot.reference.copy()
    q[7:] = rng.uniform(robot.low[7:], robot.high[7:])
    return q


@pytest.mark.parametrize("which", ["hyq_data", "anymal_data", "toy_data"])
def test_hulls_apart_means_links_apart(which: str, request: pytest.FixtureRequest) -> None:
    robot: Robot = request.getfixturevalue(which).robot
    count = len(robot.geometry.collisionPairs)
    hulls = make_bodies(robot, np.zeros(count, dtype=bool))
    by_hull = pair_test(robot, hulls.model(hulls.self_pairs))
    by_mesh = pair_test(robot, robot.geometry)
    rng = np.random.default_rng(7)
    some = False
    for _ in range(100):
        q = robot.reference.copy()
        q[7:] = rng.uniform(-2.5, 2.5, len(q) - 7)  # beyond the limits too: legs cross there
        meshes, boxes = by_mesh(q), by_hull(q)
        assert not (meshes & ~boxes).any()
        some |= bool(meshes.any())
    assert some  # the sample has collisions in it


@pytest.mark.parametrize("which", ["hyq_data", "anymal_data", "toy_data"])
def test_the_chosen_pairs_seldom_cry_wolf_and_never_miss(
    which: str, request: pytest.FixtureRequest
) -> None:
    data: RobotData = request.getfixturevalue(which)
    robot = data.robot
    chosen = pair_test(robot, data.bodies.model(data.bodies.self_pairs))
    raw = pair_test(robot, robot.geometry)
    rng = np.random.default_rng(8)
    false = 0
    for _ in range(150):
        q = random_configuration(robot, rng)
        links, bodies = raw(q).any(), chosen(q).any()
        assert bodies or not links
        false += int(bodies and not links)
    assert false <= 6
    assert not chosen(robot.reference).any()


def test_every_hull_contains_its_mesh(hyq_data: RobotData) -> None:
    bodies = hyq_data.bodies
    for hull, link in zip(
        bodies.objects[: bodies.hulls], hyq_data.robot.geometry.geometryObjects, strict=True
    ):
        assert hull.name == link.name
        if not isinstance(link.geometry, coal.BVHModelBase):
            continue
        points = np.asarray(link.geometry.vertices())
        corners = np.asarray(hull.geometry.points())
        directions = np.random.default_rng(0).normal(size=(50, 3))
        assert (
            (points @ directions.T).max(axis=0) <= (corners @ directions.T).max(axis=0) + 1e-9
        ).all()


def test_owners_and_ends(toy_data: RobotData) -> None:
    bodies, limbs = toy_data.bodies, [limb.name for limb in toy_data.robot.limbs]
    for body, owner, last in zip(bodies.objects, bodies.owner, bodies.last, strict=True):
        name, _, part = body.name.partition("_")
        assert owner == (limbs.index(name) if name in limbs else -1)
        assert last == (part in ("shank_0", "foot_0"))  # both are fixed to the knee


@pytest.mark.parametrize("which", ["hyq_data", "toy_data", "crawler_data"])
def test_every_pair_that_can_move_is_of_one_limb_or_of_two(
    which: str, request: pytest.FixtureRequest
) -> None:
    bodies: Bodies = request.getfixturevalue(which).bodies
    limbs = range(-1, int(bodies.owner.max()) + 1)
    own = {k: bodies.limb_pairs(k) for k in limbs}
    between = {(k, j): bodies.pairs_between(k, j) for k in limbs for j in range(max(k, 0))}
    for k, pairs in own.items():
        owners = [{int(bodies.owner[a]), int(bodies.owner[b])} for a, b in pairs]
        assert all(k in pair <= {k, -1} for pair in owners)
    for (k, j), pairs in between.items():
        assert all({int(bodies.owner[a]), int(bodies.owner[b])} == {k, j} for a, b in pairs)
        assert pairs == bodies.pairs_between(j, k)
    listed = [pair for pairs in (*own.values(), *between.values()) for pair in pairs]
    moving = [(int(a), int(b)) for a, b in bodies.self_pairs if bodies.group[a] != bodies.group[b]]
    assert sorted(listed) == sorted(moving)


def test_what_hangs_on_a_limbs_last_joint_is_its_own(crawler_data: RobotData) -> None:
    robot, bodies = crawler_data.robot, crawler_data.bodies
    arms = [(k, limb) for k, limb in enumerate(robot.limbs) if limb.name.endswith("_arm")]
    assert len(arms) == 2
    for k, limb in arms:
        inner = {i for i, body in enumerate(bodies.objects) if body.parentJoint in limb.joints}
        outer = {
            i
            for i, body in enumerate(bodies.objects)
            if limb.last_joint in robot.model.supports[body.parentJoint]
        }
        assert outer - inner  # fingers, which have joints of their own
        assert set(np.flatnonzero(bodies.owner == k)) == inner | outer
        assert set(np.flatnonzero((bodies.owner == k) & bodies.last)) == outer
        assert set(bodies.group[sorted(outer)]) == {limb.last_joint}


def test_unused_limbs_are_of_the_root_part(talos_data: RobotData) -> None:
    robot, bodies = talos_data.robot, talos_data.bodies
    arms = [i for i, body in enumerate(bodies.objects) if body.name.startswith("arm_")]
    assert arms
    assert set(bodies.owner[arms]) == {-1}
    assert set(bodies.group[arms]) == {ROOT_JOINT}
    assert robot.fixed_to(robot.model.getJointId("arm_left_4_joint")) == ROOT_JOINT


@pytest.mark.parametrize("moving", [(), ("torso_1_joint",), ("torso_1_joint", "torso_2_joint")])
def test_what_moves_with_one_joint_is_a_rigid_group(talos: Robot, moving: tuple[str, ...]) -> None:
    robot = Robot.load(talos.description.model_copy(update={"root_joints": moving}))
    bodies = make_bodies(robot, np.zeros(len(robot.geometry.collisionPairs), dtype=bool))
    mine = np.flatnonzero(bodies.owner == -1)
    joints = {ROOT_JOINT, *(robot.model.getJointId(name) for name in moving)}
    assert set(bodies.group[mine]) <= joints
    rng = np.random.default_rng(0)
    places = np.array([placements(robot, bodies.objects, rng) for _ in range(4)])
    apart = 0
    for first, second in bodies.self_pairs:
        if {bodies.owner[first], bodies.owner[second]} != {-1}:
            continue
        relative = np.linalg.inv(places[:, first]) @ places[:, second]
        rigid = bool(np.ptp(relative, axis=0).max() < 1e-9)
        assert rigid == (bodies.group[first] == bodies.group[second])
        listed = (int(first), int(second)) in bodies.limb_pairs(-1)
        assert listed == (not rigid)
        apart += not rigid
    assert (apart > 0) == (len(moving) > 0)


def placements(
    robot: Robot, objects: tuple[pin.GeometryObject, ...], rng: np.random.Generator
) -> list[Array]:
    """Placements (4, 4) of objects at a random configuration of the root and its joints."""
    q = robot.reference.copy()
    with_root = robot.root_index[7:]
    q[with_root] = rng.uniform(robot.low[with_root], robot.high[with_root])
    q[:3] = rng.uniform(-1, 1, 3)
    data = robot.model.createData()
    pin.forwardKinematics(robot.model, data, q)
    return [(data.oMi[body.parentJoint] * body.placement).homogeneous for body in objects]


def test_primitives_need_no_meshes(toy_data: RobotData) -> None:
    exact = find_exact_pairs(toy_data.robot, np.random.default_rng(0))
    assert not exact.any()
    assert len(toy_data.bodies.objects) == toy_data.bodies.hulls


def test_convex_is_the_hull() -> None:
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1.0)])
    cube = convex(np.vstack([corners, [[0.5, 0.5, 0.5]]]))
    ball = coal.Sphere(0.1)
    still = coal.Transform3s()

    def meets(point: list[float]) -> bool:
        result = coal.CollisionResult()
        place = coal.Transform3s(np.eye(3), np.array(point))
        coal.collide(cube, still, ball, place, coal.CollisionRequest(), result)
        return bool(result.isCollision())

    assert meets([0.5, 0.5, 0.5])
    assert meets([1.05, 0.5, 0.5])
    assert not meets([1.15, 0.5, 0.5])
