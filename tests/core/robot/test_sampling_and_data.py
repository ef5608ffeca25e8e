"""Limb samples, and the cached robot data."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from rbprm_core.arrays import Array
from rbprm_core.errors import Cancelled, InvalidInput
from rbprm_core.robot import Robot, RobotDescription, load_description
from rbprm_core.robot.bodies import make_bodies, pair_test
from rbprm_core.robot.data import RobotData, load_robot_data
from rbprm_core.robot.sampling import MAX_TILT, PITCHED, sample_limb
from rbprm_core.surface_kind import SurfaceKind


def nothing(share: float) -> None:
    assert 0 <= share <= 1


@pytest.mark.parametrize(
    "which", ["hyq_data", "toy_data", "anymal_data", "talos_data", "crawler_data"]
)
def test_samples_are_valid_configurations(which: str, request: pytest.FixtureRequest) -> None:
    data: RobotData = request.getfixturevalue(which)
    robot = data.robot
    collide = pair_test(robot, robot.geometry)
    pairs = list(robot.geometry.collisionPairs)
    parents = [robot.fixed_to(body.parentJoint) for body in robot.geometry.geometryObjects]
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


def facing(data: RobotData, limb: int) -> tuple[Array, Array]:
    """Tilt (m,) of a limb's sampled patches to the side, and forward (about y), radians."""
    x, y, z = data.databases[limb].rotations[:, :, 2].T
    return np.arcsin(y), np.arctan2(x, z)


@pytest.mark.parametrize("limb", [0, 1])
def test_samples_of_a_sole_stand_on_level_ground_for_any_pitch_of_the_root(
    talos_data: RobotData, limb: int
) -> None:
    database = talos_data.databases[limb]
    assert len(database.joints) > 500
    aside, forward = facing(talos_data, limb)
    tilt = np.arctan(MAX_TILT) + 1e-3
    assert np.abs(aside).max() <= tilt
    assert abs(aside.mean()) < 0.02
    low, high = talos_data.robot.limbs[limb].root_pitch
    assert -high - tilt <= forward.min() < -high + 0.3  # level ground, seen from a pitched root
    assert forward.max() <= -low + tilt
    upright = (np.abs(forward) <= tilt).mean()
    assert 1 - PITCHED < upright < 0.85
    assert np.ptp(np.arctan2(database.rotations[:, 1, 0], database.rotations[:, 0, 0])) > 1.0
    whole = np.tile(np.eye(3), (len(database.joints), 1, 1))
    rotations = database.rotations
    assert rotations @ np.swapaxes(rotations, 1, 2) == pytest.approx(whole)


def test_without_a_pitched_root_samples_of_a_sole_face_up(talos_data: RobotData) -> None:
    robot = talos_data.robot
    upright = replace(robot.limbs[0], root_pitch=(0.0, 0.0))
    able = replace(robot, limbs=(upright, robot.limbs[1]))
    rng = np.random.default_rng(0)
    found = sample_limb(able, talos_data.bodies, upright, 1500, rng, nothing)
    normals = found.rotations[:, :, 2]
    assert len(normals) > 300
    assert np.abs(normals[:, :2] / normals[:, 2:]).max() <= MAX_TILT + 1e-4


def test_the_centre_of_mass_of_a_sample_is_that_of_its_limb(crawler_data: RobotData) -> None:
    robot = crawler_data.robot
    scratch = robot.model.createData()
    rng = np.random.default_rng(0)
    for limb, database in zip(robot.limbs, crawler_data.databases, strict=True):
        for i in rng.integers(len(database.joints), size=20):
            q = robot.reference.copy()
            q[limb.q_index] = database.joints[i]
            pin.centerOfMass(robot.model, scratch, q, True)
            first = int(limb.joints[0])
            com = scratch.oMi[limb.base].actInv(scratch.oMi[first].act(scratch.com[first]))
            assert database.coms[i] == pytest.approx(com, abs=1e-6)
            assert limb.kinematics.mass == pytest.approx(scratch.mass[first])


def test_samples_of_a_patch_for_walls_face_sideways(talos_data: RobotData) -> None:
    robot = talos_data.robot
    leaning = replace(robot.limbs[0], surfaces=(SurfaceKind.LEAN,), root_pitch=(0.0, 0.0))
    able = replace(robot, limbs=(leaning, robot.limbs[1]))
    rng = np.random.default_rng(0)
    found = sample_limb(able, talos_data.bodies, leaning, 4000, rng, nothing)
    normals = found.rotations[:, :, 2]
    assert np.abs(normals[:, 2]).max() <= np.sin(np.arctan(MAX_TILT)) + 1e-4


def test_manipulability_is_the_root_of_the_determinant(hyq_data: RobotData) -> None:
    limb, database = hyq_data.robot.limbs[1], hyq_data.databases[1]
    for i in range(0, len(database.joints), 997):
        jacobian = limb.kinematics.position_and_jacobian(database.joints[i])[1]
        gram = jacobian @ jacobian.T
        assert database.grams[i] == pytest.approx(gram, abs=1e-9)
        assert database.manipulability[i] == pytest.approx(np.sqrt(np.linalg.det(gram)))


def test_the_same_again_from_the_cache(
    small_hyq: RobotDescription, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("RBPRM_CACHE_DIR", str(tmp_path))
    reported: list[float] = []
    computed = load_robot_data(Robot.load(small_hyq), reported.append)
    assert reported[0] == 0
    assert reported[-1] == 1
    assert reported == sorted(reported)
    (file,) = tmp_path.iterdir()
    stamp = file.stat().st_mtime_ns
    reported.clear()
    kept = load_robot_data(Robot.load(small_hyq), reported.append)
    assert set(reported) == {1.0}
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


def test_heuristics_and_the_trunk_share_the_kept_data(
    small_hyq: RobotDescription, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("RBPRM_CACHE_DIR", str(tmp_path))
    first = load_robot_data(Robot.load(small_hyq))
    other = small_hyq.with_heuristics({"lf_leg": {"effort": 1.0}}).with_trunk(
        ("trunk", "lf_upperleg"), 1.5
    )
    second = load_robot_data(Robot.load(other))
    assert len(list(tmp_path.iterdir())) == 1
    assert np.array_equal(first.databases[3].joints, second.databases[3].joints)
    assert second.robot.limbs[0].heuristics == {"effort": 1.0}
    assert len(second.trunk) > len(first.trunk)


@pytest.mark.parametrize("change", ["limbs", "surfaces", "samples"])
def test_what_the_samples_depend_on_makes_data_anew(
    small_hyq: RobotDescription,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    change: str,
) -> None:
    monkeypatch.setenv("RBPRM_CACHE_DIR", str(tmp_path))
    volumes = small_hyq.volumes.model_copy(update={"samples": 1200})
    other = {
        "limbs": small_hyq.using(["lf_leg", "rh_leg"]),
        "surfaces": small_hyq.with_surfaces({"lf_leg": (SurfaceKind.LEAN,)}),
        "samples": small_hyq.model_copy(update={"volumes": volumes}),
    }[change]
    for text in (small_hyq, other):
        load_robot_data(Robot.load(text))
    assert len(list(tmp_path.iterdir())) == 2


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
