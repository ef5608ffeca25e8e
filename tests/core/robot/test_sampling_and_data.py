"""Limb samples, and the robot data that are kept."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from rbprm_core.errors import Cancelled, InvalidInput
from rbprm_core.robot import Robot, RobotDescription, load_description
from rbprm_core.robot.bodies import make_bodies, pair_test
from rbprm_core.robot.data import RobotData, load_robot_data
from rbprm_core.robot.sampling import MOST_TILT, sample_limb, turned_onto
from rbprm_core.vocabulary import SurfaceKind

Array = NDArray[np.float64]


def nothing(share: float) -> None:
    assert 0 <= share <= 1


@pytest.mark.parametrize("which", ["hyq_data", "toy_data", "anymal_data", "talos_data"])
def test_samples_are_valid_configurations(which: str, request: pytest.FixtureRequest) -> None:
    data: RobotData = request.getfixturevalue(which)
    robot = data.robot
    collide = pair_test(robot, robot.geometry)
    pairs = list(robot.geometry.collisionPairs)
    parents = [body.parentJoint for body in robot.geometry.geometryObjects]
    scratch = robot.model.createData()
    rng = np.random.default_rng(0)
    for limb, database in zip(robot.limbs, data.databases, strict=True):
        assert len(database.joints) == limb.samples or limb.planar
        assert (database.joints >= limb.low).all()
        assert (database.joints <= limb.high).all()
        others = {j for other in robot.limbs if other is not limb for j in other.joints}
        own = np.array(
            [not {parents[p.first], parents[p.second]} & others for p in pairs], dtype=bool
        )
        for i in rng.integers(len(database.joints), size=25):
            q = robot.reference.copy()
            q[limb.q_index] = database.joints[i]
            pin.framesForwardKinematics(robot.model, scratch, q)
            base = scratch.oMi[limb.base]
            wanted = base.actInv(scratch.oMf[limb.frame] * limb.contact)
            assert database.positions[i] == pytest.approx(wanted.translation, abs=1e-9)
            assert database.rotations[i] == pytest.approx(wanted.rotation, abs=1e-9)
            assert not (collide(q) & own).any()


def test_samples_of_a_flat_foot_face_up(talos_data: RobotData) -> None:
    steepest = np.arctan(np.hypot(MOST_TILT, MOST_TILT))
    for database in talos_data.databases:
        assert len(database.joints) > 500
        normals = database.rotations[:, :, 2]
        assert normals[:, 2].min() >= np.cos(steepest) - 1e-4
        assert (np.abs(normals[:, :2].mean(axis=0)) < 0.05).all()
        assert np.ptp(np.arctan2(database.rotations[:, 1, 0], database.rotations[:, 0, 0])) > 1.0
        whole = np.tile(np.eye(3), (len(normals), 1, 1))
        assert database.rotations @ np.swapaxes(database.rotations, 1, 2) == pytest.approx(whole)


def test_samples_of_a_patch_for_walls_face_sideways(talos_data: RobotData) -> None:
    robot = talos_data.robot
    leaning = replace(robot.limbs[0], surfaces=(SurfaceKind.LEAN,))
    able = replace(robot, limbs=(leaning, robot.limbs[1]))
    rng = np.random.default_rng(0)
    found = sample_limb(able, talos_data.bodies, leaning, 4000, rng, nothing)
    normals = found.rotations[:, :, 2]
    assert np.abs(normals[:, 2]).max() <= np.sin(np.arctan(MOST_TILT)) + 1e-4


@settings(max_examples=200)
@given(seed=st.integers(0, 2**32 - 1))
def test_turned_onto_is_the_least_proper_rotation(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rotation = pin.exp3(rng.uniform(-2, 2, 3))
    normal = rng.normal(size=3)
    normal /= np.linalg.norm(normal)
    angle = np.arccos(np.clip(rotation[:, 2] @ normal, -1, 1))
    for wanted, least in ((normal, angle), (rotation[:, 2], 0.0), (-rotation[:, 2], np.pi)):
        found = turned_onto(rotation, wanted)
        assert found[:, 2] == pytest.approx(wanted)
        assert found @ found.T == pytest.approx(np.eye(3))
        assert np.linalg.det(found) == pytest.approx(1)
        assert np.linalg.norm(pin.log3(found @ rotation.T)) == pytest.approx(least, abs=1e-5)


def test_manipulability_is_the_root_of_the_determinant(hyq_data: RobotData) -> None:
    limb, database = hyq_data.robot.limbs[1], hyq_data.databases[1]
    for i in range(0, len(database.joints), 997):
        jacobian = limb.kinematics.position_and_jacobian(database.joints[i])[1]
        gram = jacobian @ jacobian.T
        assert database.grams[i] == pytest.approx(gram, abs=1e-9)
        assert database.manipulability[i] == pytest.approx(np.sqrt(np.linalg.det(gram)))


def test_the_height_is_that_of_the_reference_posture(hyq_data: RobotData) -> None:
    assert 0.4 < hyq_data.height < 0.8


def test_the_same_again_from_the_cache(
    small_hyq: RobotDescription, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("RBPRM_CACHE_DIR", str(tmp_path))
    told: list[float] = []
    computed = load_robot_data(Robot.load(small_hyq), told.append)
    assert told[0] == 0
    assert told[-1] == 1
    assert told == sorted(told)
    (file,) = tmp_path.iterdir()
    stamp = file.stat().st_mtime_ns
    told.clear()
    kept = load_robot_data(Robot.load(small_hyq), told.append)
    assert told == [1.0]
    assert file.stat().st_mtime_ns == stamp
    same_data(computed, kept)


def test_two_computations_give_the_same(
    small_hyq: RobotDescription, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = []
    for name in ("a", "b"):
        monkeypatch.setenv("RBPRM_CACHE_DIR", str(tmp_path / name))
        found.append(load_robot_data(Robot.load(small_hyq)))
    same_data(*found)


def test_another_description_has_data_of_its_own(
    small_hyq: RobotDescription, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("RBPRM_CACHE_DIR", str(tmp_path))
    first = load_robot_data(Robot.load(small_hyq))
    second = load_robot_data(Robot.load(small_hyq.model_copy(update={"seed": 1})))
    assert len(list(tmp_path.iterdir())) == 2
    assert not np.array_equal(first.databases[0].joints, second.databases[0].joints)


def test_an_edit_of_the_urdf_is_seen(
    toy_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("RBPRM_CACHE_DIR", str(tmp_path / "cache"))
    text = load_description(str(toy_file))
    urdf = tmp_path / "toy.urdf"
    urdf.write_text(Path(text.urdf).read_text())
    own = text.model_copy(update={"urdf": str(urdf)})
    before = load_robot_data(Robot.load(own))
    urdf.write_text(urdf.read_text().replace('xyz="0 0 -0.25"', 'xyz="0 0 -0.2"'))
    after = load_robot_data(Robot.load(own))
    longest = [np.linalg.norm(d.databases[0].positions, axis=1).max() for d in (before, after)]
    assert longest[1] < longest[0] - 0.05


def test_the_caller_may_stop_the_computation(
    small_hyq: RobotDescription, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("RBPRM_CACHE_DIR", str(tmp_path))

    def stop(share: float) -> None:
        if share > 0:
            raise Cancelled("robot data")

    with pytest.raises(Cancelled):
        load_robot_data(Robot.load(small_hyq), stop)
    assert list(tmp_path.iterdir()) == []


def test_a_limb_that_is_always_in_collision_is_a_bad_description(hyq: Robot) -> None:
    bodies = make_bodies(hyq, np.ones(len(hyq.geometry.collisionPairs), dtype=bool))
    folded = hyq.limbs[0]
    with pytest.raises(InvalidInput, match="free of self-collision") as caught:
        sample_limb(hyq, bodies, folded, 50, np.random.default_rng(0), nothing)
    assert caught.value.field == "limbs.lf_leg"


def same_data(a: RobotData, b: RobotData) -> None:
    for one, other in zip(a.databases, b.databases, strict=True):
        assert np.array_equal(one.joints, other.joints)
        assert np.array_equal(one.positions, other.positions)
        assert np.array_equal(one.rotations, other.rotations)
        assert np.array_equal(one.grams, other.grams)
    for here, there in zip(a.workspaces, b.workspaces, strict=True):
        assert np.array_equal(here, there)
    for piece, same in zip(a.trunk, b.trunk, strict=True):
        assert piece.joint == same.joint
        assert np.array_equal(piece.corners, same.corners)
    assert np.array_equal(a.bodies.self_pairs, b.bodies.self_pairs)
