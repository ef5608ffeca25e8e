"""Robots from their descriptions: names, limits, posture, kinematics of a limb."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import coal
import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rbprm_core.errors import InvalidInput
from rbprm_core.resources import find_resource
from rbprm_core.robot import Robot, RobotDescription, load_description
from rbprm_core.robot.data import RobotData
from rbprm_core.robot.model import ROOT_JOINT


def robot_with(**changes: Any) -> Robot:
    """HyQ with some fields of its description replaced."""
    return Robot.load(load_description("hyq").model_copy(update=changes))


def limb_with(**changes: Any) -> Robot:
    text = load_description("hyq")
    return robot_with(limbs=(text.limbs[0].model_copy(update=changes), *text.limbs[1:]))


def test_what_hyq_is(hyq: Robot) -> None:
    assert hyq.name == "hyq"
    assert 60 < hyq.mass < 120
    assert len(hyq.joint_names) == 12
    assert [limb.name for limb in hyq.limbs] == ["lf_leg", "rf_leg", "lh_leg", "rh_leg"]
    assert list(hyq.root_index) == list(range(7))
    for limb in hyq.limbs:
        assert len(limb.joints) == 3
        assert limb.last_joint == limb.joints[-1]


def test_limits_and_posture(hyq: Robot) -> None:
    assert np.isinf(hyq.low[:7]).all()
    assert np.isfinite(hyq.low[7:]).all()
    assert (hyq.low[7:] < hyq.high[7:]).all()
    assert (hyq.low <= hyq.reference).all()
    assert (hyq.reference <= hyq.high).all()
    assert hyq.reference[:7] == pytest.approx([0, 0, 0, 0, 0, 0, 1])
    for limb in hyq.limbs:
        assert np.array_equal(limb.low, hyq.low[limb.q_index])
        assert np.array_equal(limb.high, hyq.high[limb.q_index])


def test_a_range_narrows_the_urdfs_limits(hyq: Robot) -> None:
    index = hyq.limbs[0].q_index[0]
    narrow = robot_with(joint_ranges={"lf_haa_joint": (-0.1, 9.0)})
    assert narrow.low[index] == -0.1
    assert narrow.high[index] == hyq.high[index]
    assert narrow.limbs[0].low[0] == -0.1
    assert (narrow.reference >= narrow.low).all()


def test_a_posture_may_be_given_by_joint(hyq: Robot) -> None:
    index = hyq.limbs[0].q_index[1]
    robot = robot_with(reference_posture={"lf_hfe_joint": 0.5})
    assert robot.reference[index] == 0.5


@pytest.mark.parametrize("name", ["anymal", "g1", "go2", "hyq", "talos"])
def test_at_the_reference_height_the_feet_are_on_the_ground(name: str) -> None:
    """Balls and patches, at the effector's origin or offset, are as low as the links' shapes."""
    robot = Robot.load(load_description(name))
    assert -lowest_point(robot) == pytest.approx(robot.reference_height, abs=2e-3)


def lowest_point(robot: Robot) -> float:
    """The lowest z of all meshes and balls in the reference posture, the root at the origin."""
    data, places = robot.model.createData(), robot.geometry.createData()
    pin.updateGeometryPlacements(robot.model, data, robot.geometry, places, robot.reference)
    lowest = np.inf
    for body, place in zip(robot.geometry.geometryObjects, places.oMg, strict=True):
        if isinstance(body.geometry, coal.Sphere):
            lowest = min(lowest, place.translation[2] - body.geometry.radius)
        elif isinstance(body.geometry, coal.BVHModelBase):
            points = np.asarray(body.geometry.vertices()) @ place.rotation.T + place.translation
            lowest = min(lowest, points[:, 2].min())
    return float(lowest)


@settings(max_examples=60)
@given(seed=st.integers(0, 2**32 - 1), which=st.sampled_from(["hyq", "toy"]))
def test_a_limbs_own_kinematics_are_the_robots(
    hyq: Robot, toy_data: RobotData, seed: int, which: str
) -> None:
    robot = hyq if which == "hyq" else toy_data.robot
    rng = np.random.default_rng(seed)
    q = robot.reference.copy()
    q[7:] = rng.uniform(robot.low[7:], robot.high[7:])
    q[:3] = rng.uniform(-5, 5, 3)
    q[3:7] = pin.Quaternion(pin.exp3(rng.uniform(-2, 2, 3))).coeffs()
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, q)
    for limb in robot.limbs:
        base = data.oMi[limb.base]
        wanted = base.actInv(data.oMf[limb.frame].act(limb.contact.translation))
        joints = q[limb.q_index]
        position, jacobian = limb.kinematics.position_and_jacobian(joints)
        assert position == pytest.approx(wanted, abs=1e-9)
        position = position.copy()
        for k in range(len(joints)):
            step = np.zeros(len(joints))
            step[k] = 1e-6
            ahead = limb.kinematics.position_and_jacobian(joints + step)[0].copy()
            behind = limb.kinematics.position_and_jacobian(joints - step)[0].copy()
            assert jacobian[:, k] == pytest.approx((ahead - behind) / 2e-6, abs=1e-5)


@pytest.fixture(scope="module")
def kneeling() -> Robot:
    """Talos on knees and hands; the feet, beyond the knees, keep the reference posture."""
    limbs = ("left_knee", "right_knee", "left_arm", "right_arm")
    text = load_description("talos").using(limbs, ("torso_1_joint", "torso_2_joint"))
    return Robot.load(text)


@settings(max_examples=40)
@given(seed=st.integers(0, 2**32 - 1))
def test_a_limb_carries_what_hangs_beyond_it_in_the_reference_posture(
    kneeling: Robot, seed: int
) -> None:
    robot = kneeling
    rng = np.random.default_rng(seed)
    q = robot.reference.copy()
    moving = np.concatenate([robot.root_index[7:], *(limb.q_index for limb in robot.limbs)])
    q[moving] = rng.uniform(robot.low[moving], robot.high[moving])
    q[:3] = rng.uniform(-5, 5, 3)
    q[3:7] = pin.Quaternion(pin.exp3(rng.uniform(-2, 2, 3))).coeffs()
    data = robot.model.createData()
    pin.centerOfMass(robot.model, data, q, True)
    for limb in robot.limbs:
        first = int(limb.joints[0])
        wanted = data.oMi[limb.base].actInv(data.oMi[first].act(data.com[first]))
        assert limb.kinematics.com(q[limb.q_index]) == pytest.approx(wanted, abs=1e-9)
        assert limb.kinematics.mass == pytest.approx(data.mass[first])


def test_without_an_srdf_neighbours_may_touch_and_others_may_not(toy_data: RobotData) -> None:
    geometry = toy_data.robot.geometry
    names = [body.name for body in geometry.geometryObjects]
    pairs = {frozenset((names[pair.first], names[pair.second])) for pair in geometry.collisionPairs}
    assert frozenset(("lf_thigh_0", "lf_shank_0")) not in pairs
    assert frozenset(("lf_shank_0", "lf_foot_0")) not in pairs
    assert frozenset(("lf_shank_0", "rf_shank_0")) in pairs
    assert frozenset(("lf_shank_0", "trunk_0")) in pairs


def test_joints_planned_with_the_root_come_after_its_pose(toy_data: RobotData) -> None:
    robot = toy_data.robot
    waist = robot.model.joints[robot.model.getJointId("waist")].idx_q
    assert list(robot.root_index) == [*range(7), waist]
    assert robot.limbs[0].base == robot.model.getJointId("waist")
    assert robot.limbs[2].base == 1
    assert all(waist not in limb.q_index for limb in robot.limbs)


@pytest.mark.parametrize(
    ("changes", "field", "value", "known"),
    [
        ({"first_joint": "knee"}, "limbs.lf_leg.first_joint", "knee", "lf_haa_joint"),
        ({"effector": "toe"}, "limbs.lf_leg.effector", "toe", "lf_foot"),
        ({"effector": "rf_foot"}, "limbs.effector", "rf_foot", "is not attached to"),
    ],
)
def test_an_unknown_name_in_a_limb(
    changes: dict[str, str], field: str, value: str, known: str
) -> None:
    with pytest.raises(InvalidInput, match=known) as caught:
        limb_with(**changes)
    assert (caught.value.field, caught.value.value) == (field, value)


@pytest.mark.parametrize(
    ("changes", "value", "known"),
    [
        ({"urdf": "no/such.urdf"}, "no/such.urdf", "RBPRM_SHARE_PATH"),
        ({"srdf": "no/such.srdf"}, "no/such.srdf", "no such file"),
        ({"root_joints": ("tail",)}, "tail", "lf_haa_joint"),
        ({"joint_ranges": {"tail": (0.0, 1.0)}}, "tail", "lf_haa_joint"),
        ({"joint_ranges": {"lf_haa_joint": (7.0, 8.0)}}, (7.0, 8.0), "outside the URDF"),
        ({"reference_posture": "headstand"}, "headstand", "standing"),
        ({"reference_posture": {"tail": 0.0}}, "tail", "lf_haa_joint"),
    ],
)
def test_what_the_robot_does_not_have(changes: dict[str, Any], value: Any, known: str) -> None:
    with pytest.raises(InvalidInput, match=known) as caught:
        robot_with(**changes)
    assert caught.value.value == value


@pytest.mark.parametrize("text", ["", "not xml", "<robot name='x'><link name='a'>", "<sdf/>"])
def test_a_urdf_that_is_none(tmp_path: Path, text: str) -> None:
    file = tmp_path / "bad.urdf"
    file.write_text(text)
    with pytest.raises(InvalidInput, match="cannot be read") as caught:
        robot_with(urdf=str(file))
    assert caught.value.field == "robot.urdf"


def test_a_urdf_whose_meshes_are_missing(tmp_path: Path) -> None:
    text = find_resource(load_description("hyq").urdf, "urdf").read_text()
    file = tmp_path / "lost.urdf"
    file.write_text(text.replace("package://", "package://nowhere/"))
    robot = robot_with(urdf=str(file))
    with pytest.raises(InvalidInput, match="meshes cannot be read") as caught:
        robot.geometry  # noqa: B018 - it is read here
    assert caught.value.field == "robot.urdf"


def test_a_limb_needs_bounded_axes(toy_file: Path, tmp_path: Path) -> None:
    text = load_description(str(toy_file))
    urdf = tmp_path / "wheel.urdf"
    urdf.write_text(
        Path(text.urdf)
        .read_text()
        .replace('"lf_hfe" type="revolute"', '"lf_hfe" type="continuous"')
    )
    posture = {joint: angle for joint, angle in text.reference_posture.items() if joint != "lf_hfe"}
    changes = {"urdf": str(urdf), "reference_posture": posture}
    spun: RobotDescription = text.model_copy(update=changes)
    with pytest.raises(InvalidInput, match="one bounded axis") as caught:
        Robot.load(spun)
    assert caught.value.value == "lf_hfe"


def test_a_joint_is_of_the_root_or_of_a_limb() -> None:
    with pytest.raises(InvalidInput, match="is a joint of limb lf_leg") as caught:
        robot_with(root_joints=("lf_haa_joint",))
    assert (caught.value.field, caught.value.value) == ("robot.root_joints", "lf_haa_joint")


def test_two_limbs_that_share_joints_are_not_used_at_once() -> None:
    text = load_description("talos")
    with pytest.raises(InvalidInput, match="with limb left_leg: choose one of them") as caught:
        Robot.load(text.using(["left_leg", "right_leg", "left_leg_toes"]))
    assert (caught.value.field, caught.value.value) == ("limbs", "left_leg_toes")
    toes = Robot.load(text.using(["left_leg_toes", "right_leg"]))
    assert [limb.name for limb in toes.limbs] == ["right_leg", "left_leg_toes"]


def test_the_default_limbs_are_loaded() -> None:
    text = load_description("talos")
    robot = Robot.load(text)
    assert tuple(limb.name for limb in robot.limbs) == text.default_limbs
    assert [limb.name for limb in robot.description.limbs] == ["left_leg", "right_leg"]


def test_every_joint_moves_with_the_nearest_that_is_not_fixed(crawler_data: RobotData) -> None:
    robot = crawler_data.robot
    model = robot.model
    rng = np.random.default_rng(0)
    own = [int(joint) for limb in robot.limbs for joint in limb.joints]
    moving = [ROOT_JOINT, *robot.root_joints, *own]
    data = model.createData()
    poses = []
    for _ in range(3):  # all joints that move, and no others
        q = robot.reference.copy()
        index = [model.joints[joint].idx_q for joint in moving[1:]]
        q[index] = rng.uniform(robot.low[index], robot.high[index])
        q[:3] = rng.uniform(-1, 1, 3)
        pin.forwardKinematics(model, data, q)
        poses.append(
            [
                data.oMi[robot.fixed_to(j)].actInv(data.oMi[j]).homogeneous
                for j in range(ROOT_JOINT, model.njoints)
            ]
        )
    assert np.ptp(np.array(poses), axis=0).max() < 1e-9
    for joint in moving:
        assert robot.fixed_to(joint) == joint
    found = {robot.fixed_to(j) for j in range(ROOT_JOINT, model.njoints)}
    assert found == set(moving)
    assert robot.fixed_to(model.getJointId("head_2_joint")) == robot.root_joints[-1]


@pytest.mark.parametrize(
    ("joints", "reason"),
    [
        (("root_joint",), "unknown joint"),
        (("universe",), "unknown joint"),
        (("torso_1_joint", "torso_1_joint"), "named twice"),
    ],
)
def test_root_joints_are_joints_of_the_robot_and_differ(
    joints: tuple[str, ...], reason: str
) -> None:
    text = load_description("talos").using(root_joints=joints)
    with pytest.raises(InvalidInput, match=reason) as caught:
        Robot.load(text)
    assert caught.value.field == "robot.root_joints"
    assert caught.value.value == joints[0]


def test_a_limb_is_chosen_once() -> None:
    with pytest.raises(InvalidInput, match="names a limb twice"):
        load_description("hyq").using(["lf_leg", "lf_leg"])


def test_the_target_of_a_ball_is_its_centre_in_the_base_frame(hyq: Robot) -> None:
    limb, base = hyq.limbs[0], pin.SE3.Random()
    position, rotation = np.array([1.0, 2.0, 0.5]), pin.rpy.rpyToMatrix(0.1, 0.2, 0.3)
    center = position + limb.radius * rotation[:, 2]
    assert limb.radius > 0
    assert limb.spot.center(position, rotation) == pytest.approx(center)
    target, turned = limb.target(base, position, rotation)
    assert base.act(target) == pytest.approx(center)
    assert turned is None


def test_the_target_of_a_patch_is_its_middle_and_its_rotation(talos: Robot) -> None:
    limb, base = talos.limbs[0], pin.SE3.Random()
    position, rotation = np.array([1.0, 2.0, 0.5]), pin.rpy.rpyToMatrix(0.1, 0.2, 0.3)
    target, turned = limb.target(base, position, rotation)
    assert turned is not None
    assert base.act(target) == pytest.approx(position)
    assert base.rotation @ turned == pytest.approx(rotation)


def test_each_limb_has_one_contact_spot(hyq: Robot, talos: Robot) -> None:
    ball, patch = hyq.limbs[0], talos.limbs[0]
    for limb in (ball, patch):
        assert limb.spots == (limb.spot,)
        assert limb.effector == limb.spot.frame_name
    assert not ball.spot.planar
    assert ball.corners == pytest.approx(np.zeros((1, 3)))
    assert patch.spot.planar
    assert patch.spot.radius == 0
    x, y = patch.spot.half_size
    assert patch.corners == pytest.approx(
        np.array([[x, y, 0], [-x, y, 0], [-x, -y, 0], [x, -y, 0]])
    )
