"""Pairs behind a comparison of boxes collide where pinocchio's plain test says so."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import coal
import numpy as np
import pinocchio as pin
import pytest
from numpy.typing import NDArray

from rbprm_core.body import broadphase
from rbprm_core.body.broadphase import PairGroup
from rbprm_core.errors import RbprmError
from rbprm_core.robot.bodies import Bodies
from rbprm_core.robot.data import RobotData
from rbprm_core.scene import Scene, Surface, make_surface
from rbprm_core.scene.triangles import mesh_shape

Array = NDArray[np.float64]
POSES = 300
FLAT = ["ground", "wall", "slope", "stairs"]


class Plain:
    """The same pairs, each of them tested by itself."""

    def __init__(
        self,
        data: RobotData,
        pairs: Sequence[tuple[int, int]],
        against: Sequence[int],
        shapes: Sequence[coal.CollisionGeometry],
    ) -> None:
        self._robot, self._geometry = data.robot, data.bodies.model(pairs)
        for k, shape in enumerate(shapes):
            ground = pin.GeometryObject(f"o{k}", 0, pin.SE3.Identity(), shape)
            index = self._geometry.addGeometryObject(ground)
            for body in against:
                self._geometry.addCollisionPair(pin.CollisionPair(int(body), index))
        self._scratch = self._geometry.createData()
        for request in self._scratch.collisionRequests:
            request.enable_contact = True  # or some deep pairs are missed

    def collides(
        self, data: pin.Data, lifted: Sequence[int] = (), lift: Array | None = None
    ) -> bool:
        pin.updateGeometryPlacements(self._robot.model, data, self._geometry, self._scratch)
        for body in lifted:
            self._scratch.oMg[body].translation += lift
        return bool(pin.computeCollisions(self._geometry, self._scratch, True))


def flat_shapes(which: str) -> list[coal.CollisionGeometry]:
    """Coplanar meshes, boxes along the axes or not, one beside the other."""
    half = 2.0
    square = half * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0.0]])
    turned = square @ pin.rpy.rpyToMatrix(0.0, 0.3, 0.2).T
    stairs = [
        np.array([[x, -half, h], [x + 0.3, -half, h], [x + 0.3, half, h], [x, half, h]])
        for x, h in ((-0.6, 0.0), (-0.3, 0.1), (0.0, 0.2), (0.3, 0.3))
    ]
    rings = {
        "ground": [square],
        "wall": [square[:, [2, 0, 1]] + [0.4, 0, 0]],
        "slope": [turned],
        "stairs": stairs,
    }[which]
    return [mesh_shape(np.array([ring[[0, 1, 2]], ring[[0, 2, 3]]])) for ring in rings]


def pose(data: RobotData, rng: np.random.Generator) -> Array:
    """A random configuration (nq,) whose limbs now and then touch what is near the origin."""
    robot = data.robot
    q = robot.reference.copy()
    q[:3] = rng.uniform([-0.4, -0.4, 0.6 * data.height], [0.4, 0.4, 1.5 * data.height])
    q[3:7] = pin.Quaternion(pin.exp3(rng.uniform(-0.5, 0.5, 3))).coeffs()
    for limb in robot.limbs:
        near = 0.4 * (limb.high - limb.low)
        drawn = robot.reference[limb.q_index] + rng.uniform(-near, near)
        q[limb.q_index] = np.clip(drawn, limb.low, limb.high)
    return q


def own(bodies: Bodies, limb: int) -> list[int]:
    return [i for i in range(bodies.hulls) if bodies.owner[i] == limb]


def answers(
    data: RobotData, tests: Sequence[PairGroup | Plain], lifted: Sequence[int] = ()
) -> NDArray[np.bool_]:
    """What tests (t,) say of the same poses (p,): (t, p)."""
    rng = np.random.default_rng(11)
    scratch = data.robot.model.createData()
    found = []
    for _ in range(POSES):
        q, lift = pose(data, rng), rng.uniform(-0.1, 0.1, 3)
        pin.forwardKinematics(data.robot.model, scratch, q)
        found.append([test.collides(scratch, lifted, lift) for test in tests])
    return np.array(found).T


@pytest.mark.parametrize("which", ["hyq_data", "toy_data", "crawler_data"])
@pytest.mark.parametrize("shape", FLAT)
def test_flat_obstacles_are_hit(which: str, shape: str, request: pytest.FixtureRequest) -> None:
    data: RobotData = request.getfixturevalue(which)
    model, bodies = data.robot.model, data.bodies
    against, shapes = own(bodies, 0), flat_shapes(shape)
    ends = [i for i in against if bodies.last[i]]
    fast, plain = (
        PairGroup(model, bodies.objects, against=against, obstacles=shapes),
        Plain(data, [], against, shapes),
    )
    for lifted in ([], ends):
        found, wanted = answers(data, (fast, plain), lifted)
        assert np.array_equal(found, wanted)
        assert 0.05 < wanted.mean() < 0.95


@pytest.mark.parametrize("which", ["hyq_data", "crawler_data"])
def test_a_robots_own_pairs(which: str, request: pytest.FixtureRequest) -> None:
    data: RobotData = request.getfixturevalue(which)
    bodies, limbs = data.bodies, range(len(data.robot.limbs))
    met = 0
    groups = [bodies.limb_pairs(k) for k in limbs]
    groups += [bodies.pairs_between(k, j) for k in limbs for j in range(k)]
    for pairs in groups:
        fast = PairGroup(data.robot.model, bodies.objects, pairs)
        found, wanted = answers(data, (fast, Plain(data, pairs, [], [])))
        assert np.array_equal(found, wanted)
        met += int(wanted.sum())
    assert met > 0


def test_pairs_and_obstacles_together(hyq_data: RobotData, rubble_scene: Scene) -> None:
    bodies = hyq_data.bodies
    pairs, against = bodies.limb_pairs(1), own(bodies, 1)
    fast = PairGroup(hyq_data.robot.model, bodies.objects, pairs, against, rubble_scene.shapes)
    whole = Plain(hyq_data, pairs, against, [rubble_scene.shape])
    found, wanted = answers(hyq_data, (fast, whole))
    assert np.array_equal(found, wanted)  # many small shapes are one large one
    assert 0.05 < wanted.mean() < 0.95


def test_groups_of_the_same_shapes_do_not_disturb_each_other(hyq_data: RobotData) -> None:
    bodies, shapes = hyq_data.bodies, flat_shapes("stairs")
    groups = [
        PairGroup(hyq_data.robot.model, bodies.objects, against=own(bodies, 0), obstacles=shapes)
        for _ in range(3)
    ]
    found = answers(hyq_data, groups)
    assert all(np.array_equal(a, b) for a, b in pairwise(found))
    boxes = [np.array(shape.aabb_local.max_)[2] for shape in shapes]
    assert boxes == pytest.approx([0.0, 0.1, 0.2, 0.3], abs=1.5 * broadphase.THICKNESS)


def test_nothing_to_test_is_free(hyq_data: RobotData) -> None:
    robot = hyq_data.robot
    scratch = robot.model.createData()
    pin.forwardKinematics(robot.model, scratch, robot.reference)
    assert not PairGroup(robot.model, hyq_data.bodies.objects).collides(scratch)


def test_an_obstacle_that_is_left_out_is_an_error(
    hyq_data: RobotData, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without their thickness the flat boxes would be passed through."""
    monkeypatch.setattr(broadphase, "THICKNESS", 0.0)
    with pytest.raises(RbprmError, match="left out"):
        PairGroup(
            hyq_data.robot.model,
            hyq_data.bodies.objects,
            against=own(hyq_data.bodies, 0),
            obstacles=flat_shapes("ground"),
        )


def test_flat_surfaces_of_a_scene(hyq_data: RobotData) -> None:
    """What was passed through once: a scene of one polygon."""
    surface: Surface = make_surface("g", [[-9, -9, 0], [9, -9, 0], [9, 9, 0], [-9, 9, 0]], 0.5)
    shapes = Scene([surface]).shapes
    bodies, robot = hyq_data.bodies, hyq_data.robot
    group = PairGroup(robot.model, bodies.objects, against=own(bodies, 2), obstacles=shapes)
    scratch = robot.model.createData()
    for height, hit in ((hyq_data.height - 0.2, True), (hyq_data.height + 0.2, False)):
        q = robot.reference.copy()
        q[2] = height
        pin.forwardKinematics(robot.model, scratch, q)
        assert group.collides(scratch) == hit
