"""The volumes of the reachability condition (Tonneau et al. 2018, appendix A)."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from rbprm_core.arrays import Array
from rbprm_core.errors import InvalidInput
from rbprm_core.robot import Robot, load_description
from rbprm_core.robot.data import RobotData
from rbprm_core.robot.model import ROOT_JOINT
from rbprm_core.robot.volumes import reachable_workspace, simplify, trunk_volume


def beyond(points: Array, body: Array) -> float:
    """Largest distance of points outside the hull of a body, metres; negative inside."""
    equations = ConvexHull(body).equations
    return float((points @ equations[:, :3].T + equations[:, 3]).max())


@settings(max_examples=60)
@given(st.integers(0, 2**32 - 1), st.integers(20, 400), st.integers(4, 60))
def test_a_simplified_workspace_is_inside_and_has_few_faces(
    seed: int, count: int, faces: int
) -> None:
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(count, 3)) * rng.uniform(0.2, 2, 3) + rng.uniform(-3, 3, 3)
    corners = reachable_workspace(points, faces)
    assert beyond(corners, points) < 1e-9
    assert len(ConvexHull(corners).simplices) <= faces
    assert all((points == corner).all(axis=1).any() for corner in corners)


@settings(max_examples=25)
@given(st.integers(0, 2**32 - 1))
def test_more_faces_lose_less(seed: int) -> None:
    points = np.random.default_rng(seed).normal(size=(300, 3))
    hull = points[ConvexHull(points).vertices]
    volumes = [ConvexHull(simplify(hull, faces)).volume for faces in (8, 16, 38, 100, 10_000)]
    assert volumes == sorted(volumes)
    assert volumes[-1] == pytest.approx(ConvexHull(points).volume)


@pytest.mark.parametrize("which", ["hyq_data", "toy_data", "anymal_data"])
def test_workspaces_of_robots(which: str, request: pytest.FixtureRequest) -> None:
    data: RobotData = request.getfixturevalue(which)
    limit = data.robot.description.volumes.faces
    for corners, database in zip(data.workspaces, data.databases, strict=True):
        hull = ConvexHull(corners)
        assert len(hull.simplices) <= limit
        inside = (database.positions @ hull.equations[:, :3].T + hull.equations[:, 3] <= 1e-9).all(
            axis=1
        )
        assert inside.mean() > 0.65  # conservative, but not by much


def test_the_faces_are_those_of_the_workspaces(hyq_data: RobotData) -> None:
    rng = np.random.default_rng(0)
    for corners, faces in zip(hyq_data.workspaces, hyq_data.faces, strict=True):
        assert (corners @ faces[:, :3].T + faces[:, 3] < 1e-9).all()
        weights = rng.dirichlet(np.ones(len(corners)), 50)
        assert ((weights @ corners) @ faces[:, :3].T + faces[:, 3] < 1e-9).all()
        assert not (np.array([9.0, 0, 0]) @ faces[:, :3].T + faces[:, 3] <= 0).all()


@pytest.mark.parametrize("which", ["hyq", "talos"])
def test_the_trunk_is_boxes_that_contain_its_links_and_grow_with_s(
    which: str, request: pytest.FixtureRequest
) -> None:
    robot: Robot = request.getfixturevalue(which)
    small, large = trunk_volume(robot, 1.0), trunk_volume(robot, 1.2)
    links = robot.description.volumes.trunk_links
    bodies = [
        next(g for g in robot.geometry.geometryObjects if g.name == f"{link}_0") for link in links
    ]
    data = robot.model.createData()
    pin.forwardKinematics(robot.model, data, robot.reference)
    for plain, scaled, body in zip(small, large, bodies, strict=True):
        assert plain.joint == scaled.joint == ROOT_JOINT
        placement = data.oMi[ROOT_JOINT].actInv(data.oMi[body.parentJoint] * body.placement)
        vertices = np.array([placement.act(v) for v in np.asarray(body.geometry.vertices())])
        assert beyond(vertices, plain.corners) < 1e-6
        assert beyond(plain.corners, vertices) > 0  # a box, not a hull
        sides = ConvexHull(plain.corners).volume
        assert ConvexHull(scaled.corners).volume == pytest.approx(1.2**3 * sides)
        middle = plain.corners.mean(axis=0)
        assert scaled.corners - middle == pytest.approx(1.2 * (plain.corners - middle))


def test_a_box_is_its_corners(toy_data: RobotData) -> None:
    (piece,) = toy_data.trunk
    assert piece.joint == ROOT_JOINT
    assert np.abs(piece.corners) == pytest.approx(np.tile([0.25, 0.12, 0.06], (8, 1)))
    assert len(np.unique(np.sign(piece.corners), axis=0)) == 8


@pytest.mark.parametrize("torso", [(), ("torso_1_joint",), ("torso_1_joint", "torso_2_joint")])
def test_a_piece_hangs_on_the_nearest_joint_that_is_planned_with_the_root(
    talos: Robot, torso: tuple[str, ...]
) -> None:
    links = ("base_link", "torso_2_link", "leg_left_3_link")
    text = talos.description.using(root_joints=torso).with_trunk(links, None)
    robot = Robot.load(text)
    base, chest, thigh = trunk_volume(robot, 1.0)
    assert base.joint == thigh.joint == ROOT_JOINT
    joint = robot.model.getJointId(torso[-1]) if torso else ROOT_JOINT
    assert chest.joint == joint
    body = next(g for g in robot.geometry.geometryObjects if g.name == "torso_2_link_0")
    data = robot.model.createData()
    pin.forwardKinematics(robot.model, data, robot.reference)
    placed = np.array([data.oMi[joint].act(corner) for corner in chest.corners])
    own = data.oMi[body.parentJoint] * body.placement
    vertices = np.array([own.act(v) for v in np.asarray(body.geometry.vertices())])
    assert beyond(vertices, placed) < 1e-6  # whichever its joint, it is placed where the link is


def test_a_leg_of_the_trunk_is_where_the_reference_posture_puts_it() -> None:
    text = load_description("talos").with_trunk(("leg_left_3_link",), None)
    pieces = []
    for bend in (0.0, -0.8):
        posture = {"leg_left_3_joint": bend}
        robot = Robot.load(text.model_copy(update={"reference_posture": posture}))
        (piece,) = trunk_volume(robot, 1.0)
        pieces.append(piece.corners)
    assert pieces[1].mean(axis=0)[0] > pieces[0].mean(axis=0)[0] + 0.1  # forward
    sizes = [np.linalg.norm(corners - corners[0], axis=1) for corners in pieces]
    assert sizes[0] == pytest.approx(sizes[1])  # turned, but the same box


def test_a_trunk_link_must_be_one() -> None:
    robot = Robot.load(load_description("hyq").with_trunk(("trunk", "wing"), None))
    with pytest.raises(InvalidInput, match="no collision geometry") as caught:
        trunk_volume(robot, 1.1)
    assert (caught.value.field, caught.value.value) == ("volumes.trunk_links", "wing")
