"""The volumes of appendix A."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from rbprm_core.errors import InvalidInput
from rbprm_core.robot import Robot, load_description
from rbprm_core.robot.data import RobotData
from rbprm_core.robot.model import ROOT_JOINT
from rbprm_core.robot.volumes import reachable_workspace, simplify, trunk_volume

Array = NDArray[np.float64]


def beyond(points: Array, body: Array) -> float:
    """How far points reach out of the hull of a body, at most; negative inside."""
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
    most = data.robot.description.volumes.faces
    for corners, database in zip(data.workspaces, data.databases, strict=True):
        hull = ConvexHull(corners)
        assert len(hull.simplices) <= most
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


def test_the_trunk_contains_its_links_and_grows_with_s(hyq: Robot) -> None:
    (small,), (large,) = trunk_volume(hyq, 1.0), trunk_volume(hyq, 1.2)
    assert small.joint == large.joint == ROOT_JOINT
    plain, scaled = small.corners, large.corners
    trunk = next(g for g in hyq.geometry.geometryObjects if g.name.startswith("trunk"))
    vertices = np.array([trunk.placement.act(v) for v in np.asarray(trunk.geometry.vertices())])
    assert beyond(vertices, plain) < 1e-6
    assert beyond(plain, scaled) < 1e-9
    assert ConvexHull(scaled).volume == pytest.approx(1.2**3 * ConvexHull(plain).volume)
    assert np.ptp(scaled, axis=0) == pytest.approx(1.2 * np.ptp(plain, axis=0))


def test_a_box_is_its_corners(toy_data: RobotData) -> None:
    (piece,) = toy_data.trunk
    assert piece.joint == ROOT_JOINT
    assert np.abs(piece.corners) == pytest.approx(np.tile([0.25, 0.12, 0.06], (8, 1)))
    assert len(np.unique(np.sign(piece.corners), axis=0)) == 8


def test_a_piece_moves_with_the_joint_that_is_planned_with_the_root(talos: Robot) -> None:
    text = talos.description
    volumes = text.volumes.model_copy(update={"trunk_links": ("base_link", "torso_2_link")})
    own = text.model_copy(update={"volumes": volumes})
    with pytest.raises(InvalidInput, match="moves against the root") as caught:
        trunk_volume(Robot.load(own), 1.0)
    assert caught.value.value == "torso_2_link"
    turning = {"root_joints": ("torso_1_joint", "torso_2_joint")}
    robot = Robot.load(own.model_copy(update=turning))
    joints = [piece.joint for piece in trunk_volume(robot, 1.0)]
    assert joints == sorted(joints)
    assert set(joints) == {ROOT_JOINT, robot.model.getJointId("torso_2_joint")}


@pytest.mark.parametrize(
    ("links", "reason"),
    [(("wing",), "no collision geometry"), (("trunk", "lf_upperleg"), "moves against the root")],
)
def test_a_trunk_link_must_be_one(links: tuple[str, ...], reason: str) -> None:
    text = load_description("hyq")
    changes: dict[str, Any] = {"trunk_links": links}
    volumes = text.volumes.model_copy(update=changes)
    robot = Robot.load(text.model_copy(update={"volumes": volumes}))
    with pytest.raises(InvalidInput, match=reason) as caught:
        trunk_volume(robot, 1.1)
    assert (caught.value.field, caught.value.value) == ("volumes.trunk_links", links[-1])
