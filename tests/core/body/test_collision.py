"""Collision of the robot in a scene, with contacts allowed to touch."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from rbprm_core.body.collision import LIFT, CollisionModel
from rbprm_core.robot.bodies import pair_test
from rbprm_core.robot.data import RobotData
from rbprm_core.scene import Scene, Surface, make_surface

Array = NDArray[np.float64]
Box = Callable[..., list[Surface]]
UP = np.array([0.0, 0.0, 1.0])


def foot(data: RobotData, q: Array, limb: int) -> Array:
    """Centre of a foot's ball in the world."""
    this = data.robot.limbs[limb]
    scratch = data.robot.model.createData()
    pin.framesForwardKinematics(data.robot.model, scratch, q)
    return np.asarray(scratch.oMf[this.frame].act(this.contact.translation)).copy()


def standing(data: RobotData, height: float) -> Array:
    """The reference posture with the first foot's ball this much over z = 0."""
    q = data.robot.reference.copy()
    q[2] = height + data.robot.limbs[0].radius - foot(data, q, 0)[2]
    return q


@pytest.fixture(scope="module", params=["hyq_data", "anymal_data", "toy_data"])
def data(request: pytest.FixtureRequest) -> RobotData:
    found: RobotData = request.getfixturevalue(request.param)
    return found


@pytest.fixture(scope="module")
def model(data: RobotData, flat_scene: Scene) -> CollisionModel:
    return CollisionModel(data, flat_scene)


@pytest.mark.parametrize(
    ("height", "touching", "free"),
    [
        (0.05, True, True),
        (0.05, False, True),
        (1e-6, False, True),
        (0.0, True, True),
        (-0.5 * LIFT, True, True),
        (-0.5 * LIFT, False, False),
        (-2e-3, True, False),  # a plan may sink no deeper
        (-0.03, True, False),
        (-0.03, False, False),
    ],
)
def test_a_contact_may_touch_but_not_sink(
    data: RobotData, model: CollisionModel, height: float, touching: bool, free: bool
) -> None:
    q = standing(data, height)
    assert model.limb_free(q, 0, UP if touching else None) == free


def test_the_lift_is_undone_after_a_test(data: RobotData, model: CollisionModel) -> None:
    q = standing(data, -0.5 * LIFT)
    answers = [model.limb_free(q, 0, normal) for normal in (UP, None, UP, UP, None)]
    assert answers == [True, False, True, True, False]


def test_only_the_links_that_end_the_limb_are_lifted(
    hyq_data: RobotData, flat_scene: Scene, make_box: Box
) -> None:
    q = standing(hyq_data, 0.0)
    thigh = next(g for g in hyq_data.robot.geometry.geometryObjects if g.name == "lf_upperleg_0")
    scratch = hyq_data.robot.model.createData()
    pin.forwardKinematics(hyq_data.robot.model, scratch, q)
    vertices = np.asarray(thigh.geometry.vertices())
    placement = scratch.oMi[thigh.parentJoint] * thigh.placement
    middle = placement.act((vertices.min(axis=0) + vertices.max(axis=0)) / 2)
    block = make_box("b", middle - 0.02, middle + 0.02)
    blocked = CollisionModel(hyq_data, flat_scene.edited(changed=block))
    assert not blocked.limb_free(q, 0, UP)
    assert blocked.limb_free(q, 1, UP)


def test_the_trunk_against_a_block(
    data: RobotData, flat_scene: Scene, model: CollisionModel, make_box: Box
) -> None:
    q = standing(data, 0.0)
    assert model.root_free(q)
    half = np.array([0.02, 0.02, 2])
    through = make_box("b", q[:3] - half, q[:3] + half)
    assert not CollisionModel(data, flat_scene.edited(changed=through)).root_free(q)
    beside = make_box("b", q[:3] + 2, q[:3] + 3)
    assert CollisionModel(data, flat_scene.edited(changed=beside)).root_free(q)
    low = q.copy()
    low[2] = 0.0
    assert not model.root_free(low)


@settings(max_examples=120)
@given(seed=st.integers(0, 2**32 - 1))
def test_what_is_called_free_is_free_of_self_collision(hyq_data: RobotData, seed: int) -> None:
    robot = hyq_data.robot
    rng = np.random.default_rng(seed)
    q = robot.reference.copy()
    q[2] = 50
    q[7:] = rng.uniform(robot.low[7:], robot.high[7:])
    far = Scene([make_surface("far", [[0, 0, 0], [1, 0, 0], [0, 1, 0]], 0.5)])
    model = CollisionModel(hyq_data, far)
    if model.root_free(q) and all(model.limb_free(q, k, None) for k in range(4)):
        assert not pair_test(robot, robot.geometry)(q).any()


def test_crossed_legs_collide(hyq_data: RobotData, flat_scene: Scene) -> None:
    robot = hyq_data.robot
    model = CollisionModel(hyq_data, flat_scene)
    rng = np.random.default_rng(0)
    collide = pair_test(robot, robot.geometry)
    met = 0
    for _ in range(150):
        q = robot.reference.copy()
        q[2] = 50
        q[7:] = rng.uniform(robot.low[7:], robot.high[7:])
        if collide(q).any():
            met += 1
            assert not (model.root_free(q) and all(model.limb_free(q, k, None) for k in range(4)))
    assert met > 3


@pytest.mark.parametrize("which", ["hyq_data", "crawler_data"])
def test_a_limb_is_tested_against_those_that_are_not_left_out(
    which: str, flat_scene: Scene, request: pytest.FixtureRequest
) -> None:
    data: RobotData = request.getfixturevalue(which)
    robot = data.robot
    model = CollisionModel(data, flat_scene)
    rng = np.random.default_rng(3)
    blocked = 0
    for _ in range(150):
        q = robot.reference.copy()
        q[2] = 50
        for limb in robot.limbs:
            q[limb.q_index] = rng.uniform(limb.low, limb.high)
        for k in range(4):
            rest = {0, 1, 2, 3} - {k}
            alone = model.limb_free(q, k, None, rest)
            apart = {j: model.limb_free(q, k, None, rest - {j}) for j in rest}
            gone = set(rng.choice(4, 2, replace=False).tolist())
            wanted = alone and all(apart[j] for j in rest - gone)
            assert model.limb_free(q, k, None, gone) == wanted
            assert model.limb_free(q, k, None) == (alone and all(apart.values()))
            blocked += alone and not all(apart.values())
    assert blocked > 0
