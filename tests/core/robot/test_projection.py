"""Projection of a limb onto a contact."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rbprm_core.robot import Robot
from rbprm_core.robot.data import RobotData
from rbprm_core.robot.projection import ROTATION_LENGTH, TOLERANCE, _facing_task, face, project

seeds = st.integers(0, 2**32 - 1)


@settings(max_examples=200)
@given(seed=seeds, limb=st.integers(0, 3), away=st.floats(0, 0.1))
def test_what_is_found_is_inside_the_limits_and_on_the_target(
    hyq_data: RobotData, seed: int, limb: int, away: float
) -> None:
    rng = np.random.default_rng(seed)
    this, database = hyq_data.robot.limbs[limb], hyq_data.databases[limb]
    i = int(rng.integers(len(database.joints)))
    direction = rng.normal(size=3)
    target = database.positions[i] + away * direction / np.linalg.norm(direction)
    start = database.joints[i].copy()
    joints = project(this, start, target)
    assert np.array_equal(start, database.joints[i])
    if joints is not None:
        assert (joints >= this.low).all()
        assert (joints <= this.high).all()
        reached, _ = this.kinematics.position_and_jacobian(joints)
        assert np.linalg.norm(reached - target) <= TOLERANCE


def test_a_target_that_is_near_and_well_inside_is_reached(hyq_data: RobotData) -> None:
    rng = np.random.default_rng(1)
    tried = reached = 0
    for limb, database in zip(hyq_data.robot.limbs, hyq_data.databases, strict=True):
        span = limb.high - limb.low
        middle = (np.abs(database.joints - (limb.low + limb.high) / 2) < 0.35 * span).all(axis=1)
        for i in rng.choice(np.flatnonzero(middle), 100):
            direction = rng.normal(size=3)
            target = database.positions[i] + 0.02 * direction / np.linalg.norm(direction)
            tried += 1
            reached += project(limb, database.joints[i], target) is not None
    assert reached > 0.95 * tried


def test_the_start_is_the_answer_where_it_is_there_already(hyq: Robot) -> None:
    limb = hyq.limbs[2]
    joints = hyq.reference[limb.q_index]
    target = limb.kinematics.position_and_jacobian(joints)[0].copy()
    assert project(limb, joints, target) == pytest.approx(joints, abs=1e-4)


@settings(max_examples=50)
@given(seed=seeds, limb=st.integers(0, 3))
def test_what_is_out_of_reach_is_not_found(hyq_data: RobotData, seed: int, limb: int) -> None:
    rng = np.random.default_rng(seed)
    database = hyq_data.databases[limb]
    direction = rng.normal(size=3)
    farthest = np.linalg.norm(database.positions, axis=1).max()
    target = 2 * farthest * direction / np.linalg.norm(direction)
    start = database.joints[rng.integers(len(database.joints))]
    assert project(hyq_data.robot.limbs[limb], start, target) is None


@settings(max_examples=200)
@given(seed=seeds, limb=st.integers(0, 1), away=st.floats(0, 0.08), turn=st.floats(0, 0.5))
def test_a_patch_that_is_found_is_inside_the_limits_and_has_the_pose(
    talos_data: RobotData, seed: int, limb: int, away: float, turn: float
) -> None:
    rng = np.random.default_rng(seed)
    this, database = talos_data.robot.limbs[limb], talos_data.databases[limb]
    i = int(rng.integers(len(database.joints)))
    directions = rng.normal(size=(2, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    target = database.positions[i] + away * directions[0]
    rotation = pin.exp3(turn * directions[1]) @ database.rotations[i]
    start = database.joints[i].copy()
    joints = project(this, start, target, rotation)
    assert np.array_equal(start, database.joints[i])
    if joints is not None:
        assert (joints >= this.low).all()
        assert (joints <= this.high).all()
        position, turned, _ = this.kinematics.placement_and_jacobian(joints)
        assert np.linalg.norm(position - target) <= TOLERANCE
        assert np.linalg.norm(pin.log3(turned.T @ rotation)) <= TOLERANCE / ROTATION_LENGTH
        assert np.linalg.det(turned) == pytest.approx(1)


def test_a_pose_that_is_near_and_well_inside_is_reached(talos_data: RobotData) -> None:
    rng = np.random.default_rng(1)
    tried = reached = 0
    for limb, database in zip(talos_data.robot.limbs, talos_data.databases, strict=True):
        span = limb.high - limb.low
        middle = (np.abs(database.joints - (limb.low + limb.high) / 2) < 0.42 * span).all(axis=1)
        for i in rng.choice(np.flatnonzero(middle), 100):
            direction = rng.normal(size=3)
            target = database.positions[i] + 0.01 * direction / np.linalg.norm(direction)
            rotation = pin.exp3(rng.uniform(-0.04, 0.04, 3)) @ database.rotations[i]
            tried += 1
            reached += project(limb, database.joints[i], target, rotation) is not None
    assert reached > 0.95 * tried


@settings(max_examples=30)
@given(seed=seeds, limb=st.integers(0, 1))
def test_the_jacobian_of_a_placement_is_its_derivative(talos: Robot, seed: int, limb: int) -> None:
    this = talos.limbs[limb]
    joints = np.random.default_rng(seed).uniform(this.low, this.high)
    position, rotation, jacobian = this.kinematics.placement_and_jacobian(joints)
    for k in range(len(joints)):
        step = np.zeros(len(joints))
        step[k] = 1e-6
        ahead, turned, _ = this.kinematics.placement_and_jacobian(joints + step)
        assert jacobian[:3, k] == pytest.approx((ahead - position) / 1e-6, abs=1e-4)
        assert jacobian[3:, k] == pytest.approx(pin.log3(turned @ rotation.T) / 1e-6, abs=1e-4)
    only, linear = this.kinematics.position_and_jacobian(joints)
    assert only == pytest.approx(position)
    assert linear == pytest.approx(jacobian[:3])


@settings(max_examples=150)
@given(seed=seeds, limb=st.integers(0, 3), turn=st.floats(0, 3.1))
def test_a_patch_that_faces_a_normal_is_inside_the_limits(
    crawler_data: RobotData, seed: int, limb: int, turn: float
) -> None:
    rng = np.random.default_rng(seed)
    this = crawler_data.robot.limbs[limb]
    start = rng.uniform(this.low, this.high)
    before = start.copy()
    axis = this.kinematics.placement_and_jacobian(start)[1][:, 2]
    across = np.cross(axis, rng.normal(size=3))
    normal = pin.exp3(turn * across / np.linalg.norm(across)) @ axis
    joints = face(this, start, normal)
    assert np.array_equal(start, before)
    if joints is not None:
        assert (joints >= this.low).all()
        assert (joints <= this.high).all()
        reached = this.kinematics.placement_and_jacobian(joints)[1][:, 2]
        assert np.linalg.norm(reached - normal) <= 1.01 * TOLERANCE / ROTATION_LENGTH


def test_a_patch_is_turned_a_little_nearly_always(crawler_data: RobotData) -> None:
    rng = np.random.default_rng(2)
    tried = reached = 0
    for limb, database in zip(crawler_data.robot.limbs, crawler_data.databases, strict=True):
        for i in rng.integers(len(database.joints), size=100):
            axis = database.rotations[i][:, 2]
            normal = pin.exp3(rng.uniform(-0.05, 0.05, 3)) @ axis
            joints = face(limb, database.joints[i], normal)
            tried += 1
            if joints is not None:
                reached += 1
                assert np.abs(joints - database.joints[i]).max() < 1.0
    assert reached > 0.95 * tried


@settings(max_examples=20)
@given(seed=seeds)
def test_a_patch_that_looks_the_other_way_does_not_face(crawler_data: RobotData, seed: int) -> None:
    """A rotation by half a turn has no unique axis, but is still a rotation."""
    rng = np.random.default_rng(seed)
    arm = next(limb for limb in crawler_data.robot.limbs if limb.name == "left_arm")
    start = rng.uniform(arm.low, arm.high)
    axis = arm.kinematics.placement_and_jacobian(start)[1][:, 2]
    joints = face(arm, start, -axis)
    if joints is not None:
        reached = arm.kinematics.placement_and_jacobian(joints)[1][:, 2]
        assert reached == pytest.approx(-axis, abs=1e-4)


@settings(max_examples=40)
@given(seed=seeds, limb=st.integers(0, 3))
def test_the_jacobian_of_facing_is_how_the_error_shrinks(
    crawler_data: RobotData, seed: int, limb: int
) -> None:
    rng = np.random.default_rng(seed)
    this = crawler_data.robot.limbs[limb]
    joints = rng.uniform(this.low, this.high)
    axis = this.kinematics.placement_and_jacobian(joints)[1][:, 2].copy()
    _, jacobian = _facing_task(this, joints, axis)
    for k in range(len(joints)):  # from where it faces, each joint turns it away
        step = np.zeros(len(joints))
        step[k] = 1e-6
        error, _ = _facing_task(this, joints + step, axis)
        assert -error / 1e-6 == pytest.approx(jacobian[:, k], abs=1e-5)
