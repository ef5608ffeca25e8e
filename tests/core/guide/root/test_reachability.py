"""Reachability condition: close enough for contact, free of collision."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from rbprm_core.arrays import Array
from rbprm_core.failures import Cause, Failure
from rbprm_core.guide.root import Reachability
from rbprm_core.guide.root_space import RootSegment
from rbprm_core.robot.data import RobotData
from rbprm_core.scene import Scene, Surface, make_surface

Box = Callable[..., list[Surface]]
LEGS = ("lf_leg", "rf_leg", "lh_leg", "rh_leg")


def at(x: float, y: float, z: float, yaw: float = 0.0) -> Array:
    turn = pin.Quaternion(pin.exp3(np.array([0, 0, yaw]))).coeffs()
    return np.concatenate([[x, y, z], turn])


def slab(name: str, x: tuple[float, float], y: tuple[float, float], z: float = 0) -> Surface:
    return make_surface(
        name, [[a, b, z] for a, b in zip((*x, *x[::-1]), np.repeat(y, 2), strict=True)], 0.5
    )


@pytest.fixture(scope="module")
def condition(hyq_data: RobotData, flat_scene: Scene) -> Reachability:
    return Reachability(hyq_data, flat_scene, LEGS)


def test_a_robot_that_stands_is_reachable(condition: Reachability) -> None:
    assert condition.holds(at(0, 0, 0.6))
    assert condition.failure(at(0, 0, 0.6)) is None


@settings(max_examples=50)
@given(height=st.floats(1.2, 100), x=st.floats(-4, 4), yaw=st.floats(-3, 3))
def test_far_from_the_ground_it_fails(
    condition: Reachability, height: float, x: float, yaw: float
) -> None:
    root = at(x, 0, height, yaw)
    assert not condition.holds(root)
    failure = condition.failure(root)
    assert failure is not None
    assert failure.cause == Cause.NO_SURFACE_IN_WORKSPACE
    assert failure.limb in LEGS
    assert failure.kinds == ("support",)


@settings(max_examples=50)
@given(height=st.floats(-0.1, 0.1), x=st.floats(-4, 4), yaw=st.floats(-3, 3))
def test_a_trunk_in_the_ground_fails(
    condition: Reachability, height: float, x: float, yaw: float
) -> None:
    root = at(x, 0, height, yaw)
    assert not condition.holds(root)
    failure = condition.failure(root)
    assert failure is not None
    assert failure.limb == ""
    assert failure.cause in (Cause.TRUNK_IN_OBSTACLE, Cause.TRUNK_COLLISION)
    assert condition.trunk_failure(root) == failure


@settings(max_examples=200)
@given(seed=st.integers(0, 2**32 - 1))
def test_on_a_plane_it_agrees_with_the_corners(
    condition: Reachability, hyq_data: RobotData, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    rotation = pin.exp3(rng.uniform(-0.3, 0.3, 3))
    position = np.array([0, 0, rng.uniform(0.1, 1.2)])
    root = np.concatenate([position, pin.Quaternion(rotation).coeffs()])
    trunk = np.concatenate([piece.corners for piece in hyq_data.trunk]) @ rotation.T + position
    lowest = [
        (corners @ rotation.T + position)[:, 2] for corners in hyq_data.workspaces
    ]  # HyQ's legs are attached to the root joint itself
    margin = min(abs(trunk[:, 2].min()), *(abs(z.min()) for z in lowest))
    if margin > 1e-3:
        wanted = trunk[:, 2].min() > 0 and all(z.min() < 0 < z.max() for z in lowest)
        assert condition.holds(root) == wanted
        assert (condition.failure(root) is None) == wanted


def test_each_required_limb_needs_a_surface_of_its_own(hyq_data: RobotData) -> None:
    behind = Scene([slab("behind", (-2.0, 0.0), (-2.0, 2.0))])
    root = at(0.1, 0, 0.6)
    assert Reachability(hyq_data, behind, ("lh_leg", "rh_leg")).holds(root)
    assert Reachability(hyq_data, behind, ()).holds(at(0, 0, 50))
    over = at(0.5, 0, 0.6)
    everywhere = Reachability(hyq_data, behind, LEGS)
    assert not everywhere.holds(over)
    failure = everywhere.failure(over)
    assert failure is not None
    assert failure.limb in ("lf_leg", "rf_leg")


def test_a_surface_of_another_kind_does_not_count(hyq_data: RobotData) -> None:
    ceiling = make_surface("c", [[-5, -5, 0], [-5, 5, 0], [5, 5, 0], [5, -5, 0]], 0.5)
    condition = Reachability(hyq_data, Scene([ceiling]), LEGS)
    assert not condition.holds(at(0, 0, 0.6))
    failure = condition.failure(at(0, 0, 0.6))
    assert failure == Failure.of(Cause.NO_SURFACE_OF_KIND, "lf_leg", kinds=("support",))


def test_inside_an_obstacle(hyq_data: RobotData, make_box: Box) -> None:
    block = make_box("b", np.array([-3, -3, 0.0]), np.array([3, 3, 3.0]))
    condition = Reachability(hyq_data, Scene(block), LEGS)
    assert condition.failure(at(0, 0, 1.5)) == Failure.of(Cause.TRUNK_IN_OBSTACLE)
    assert not condition.holds(at(0, 0, 1.5))


def test_a_bigger_trunk_needs_more_room(hyq_data: RobotData, flat_scene: Scene) -> None:
    lowest = float(np.concatenate([piece.corners for piece in hyq_data.trunk])[:, 2].min())
    just = Reachability(hyq_data, flat_scene, ())
    assert just.holds(at(0, 0, -lowest + 1e-3))
    assert not just.holds(at(0, 0, -lowest - 1e-3))


@settings(max_examples=40)
@given(seed=st.integers(0, 2**32 - 1), steps=st.integers(1, 20))
def test_an_edge_holds_where_all_its_points_do(
    condition: Reachability, seed: int, steps: int
) -> None:
    rng = np.random.default_rng(seed)
    a, b = (at(*rng.uniform([-1, -1, 0.2], [1, 1, 0.9])) for _ in range(2))
    wanted = all(condition.holds(RootSegment(a, b).at(i / steps)) for i in range(1, steps + 1))
    assert condition.edge_holds(RootSegment(a, b), steps) == wanted


def test_avoided_roots_fail_but_start_and_goal_do_not(
    hyq_data: RobotData, flat_scene: Scene
) -> None:
    condition = Reachability(hyq_data, flat_scene, LEGS)
    here, near, far = at(0, 0, 0.6), at(0.05, 0, 0.6), at(1, 0, 0.6)
    condition.avoid(near, keep=(here,))
    assert condition.holds(near)
    condition.avoid(here, keep=(far,))
    assert not condition.holds(here)
    assert not condition.holds(near)
    assert condition.holds(far)


@settings(max_examples=60)
@given(seed=st.integers(0, 2**32 - 1))
def test_a_joint_planned_with_the_root_moves_its_limbs(toy_data: RobotData, seed: int) -> None:
    rng = np.random.default_rng(seed)
    robot = toy_data.robot
    root = np.concatenate([[0, 0, toy_data.height], [0, 0, 0, 1], rng.uniform(-0.4, 0.4, 1)])
    x, y = rng.uniform([0.0, -0.3], [0.9, 0.6])
    tile = slab("tile", (x, x + 0.1), (y, y + 0.1))
    q = robot.reference.copy()
    q[robot.root_index] = root
    data = robot.model.createData()
    pin.forwardKinematics(robot.model, data, q)
    base = data.oMi[robot.limbs[0].base]
    workspace = toy_data.workspaces[0] @ base.rotation.T + base.translation
    condition = Reachability(toy_data, Scene([tile]), ("lf",))
    assert condition.holds(root) == convex_bodies_meet(workspace, tile.polygon.boundary)


def convex_bodies_meet(a: Array, b: Array) -> bool:
    """True where the hulls of two sets of points intersect, by a linear programme."""
    equal = np.vstack(
        [
            np.hstack([a.T, -b.T]),
            np.hstack([np.ones(len(a)), np.zeros(len(b))]),
            np.hstack([np.zeros(len(a)), np.ones(len(b))]),
        ]
    )
    found = linprog(np.zeros(len(a) + len(b)), A_eq=equal, b_eq=[0, 0, 0, 1, 1])
    return bool(found.status == 0)
