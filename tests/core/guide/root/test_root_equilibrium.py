"""Equilibrium condition on roots, compared with the equilibrium of single sets of contacts."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from rbprm_core.arrays import Array
from rbprm_core.failures import Cause, Failure
from rbprm_core.guide.root import EquilibriumTest, Reachability
from rbprm_core.guide.root_space import RootSegment
from rbprm_core.robot.data import RobotData
from rbprm_core.scene import Scene, Surface, make_surface
from rbprm_core.statics import Equilibrium, cone_generators, robustness

LEGS = ("lf_leg", "rf_leg", "lh_leg", "rh_leg")
DOWN = np.array([0, 0, -9.81])


def at(x: float, y: float, z: float, turn: Array | None = None) -> Array:
    rotation = np.eye(3) if turn is None else pin.exp3(turn)
    return np.concatenate([[x, y, z], pin.Quaternion(rotation).coeffs()])


def strip(name: str, low: float, high: float, tilt: float = 0.0) -> Surface:
    """Ground between two values of y in metres, tilted about the x axis by an angle in radians."""
    middle, half = (low + high) / 2, (high - low) / 2
    rise = half * np.tan(tilt)
    ring = [[-3, low, -rise], [3, low, -rise], [3, high, rise], [-3, high, rise]]
    assert middle is not None
    return make_surface(name, ring, 0.5)


def test_on_flat_ground_it_holds(hyq_data: RobotData, flat_scene: Scene) -> None:
    test = EquilibriumTest(hyq_data, flat_scene, LEGS, DOWN)
    for turn in (None, np.array([0, 0, 1.0]), np.array([0.1, -0.1, 0.4])):
        assert test.holds(at(0.3, -0.2, 0.6, turn))


def test_ground_under_the_left_feet_alone_fails(hyq_data: RobotData) -> None:
    scene = Scene([strip("left", 0.25, 0.6)])
    left = ("lf_leg", "lh_leg")
    root = at(0, 0, 0.6)
    assert Reachability(hyq_data, scene, left).holds(root)
    test = EquilibriumTest(hyq_data, scene, left, DOWN)
    assert not test.holds(root)
    condition = Reachability(hyq_data, scene, left, test)
    assert not condition.holds(root)
    assert condition.failure(root) == Failure.of(Cause.WEIGHT_UNSUPPORTED)
    assert test.holds(at(0, 0.4, 0.6))  # over the strip


def test_two_steep_walls_hold_where_one_does_not(hyq_data: RobotData) -> None:
    """Walls that face each other, each too steep to stand on alone."""
    floors = [
        make_surface(
            n, [[-3, y, 0.0], [3, y, 0.0], [3, y + w, abs(w)], [-3, y + w, abs(w)]][::o], 0.5
        )
        for n, y, w, o in (("left", 0.2, 0.5, 1), ("right", -0.2, -0.5, -1))
    ]
    tilted = [Surface(s.id, s.polygon, s.friction, strip("x", 0, 1).kind) for s in floors]
    root = at(0, 0, 0.62)
    assert all(s.normal[2] > 0.7 for s in tilted)
    assert EquilibriumTest(hyq_data, Scene(tilted), LEGS, DOWN).holds(root)
    for one in tilted:
        assert not EquilibriumTest(hyq_data, Scene([one]), LEGS, DOWN).holds(root)


def test_without_weight_there_is_nothing_to_bear(hyq_data: RobotData) -> None:
    scene = Scene([strip("far", 50, 51)])
    assert EquilibriumTest(hyq_data, scene, LEGS, np.zeros(3)).holds(at(0, 0, 0.6))
    assert not EquilibriumTest(hyq_data, scene, LEGS, DOWN).holds(at(0, 0, 0.6))
    assert not EquilibriumTest(hyq_data, scene, (), DOWN).holds(at(0, 0, 0.6))


@settings(max_examples=60)
@given(seed=st.integers(0, 2**32 - 1))
def test_it_is_necessary(hyq_data: RobotData, seed: int) -> None:
    """Where contacts within the workspaces hold the robot, the condition holds too."""
    rng = np.random.default_rng(seed)
    tiles = []
    for i in range(6):
        x, y = rng.uniform([-0.7, -0.6], [0.3, 0.2])
        z, (sx, sy) = rng.uniform(-0.1, 0.1), rng.uniform(-0.3, 0.3, 2)
        ring = [
            [x + u, y + v, z + sx * u + sy * v] for u, v in ((0, 0), (0.4, 0), (0.4, 0.3), (0, 0.3))
        ]
        tiles.append(make_surface(f"t{i}", ring, 0.6))
    scene = Scene(tiles)
    root = at(*rng.uniform([-0.5, -0.4, 0.5], [0.5, 0.4, 0.65]), rng.uniform(-0.2, 0.2, 3))
    contacts = drawn_contacts(hyq_data, scene, root, rng)
    if contacts is None:
        return
    robot, (points, cones) = hyq_data.robot, contacts
    q = robot.reference.copy()
    q[:7] = root
    com = pin.centerOfMass(robot.model, robot.model.createData(), q)
    stands = robustness(Equilibrium.of(points, cones, com, robot.mass, DOWN)) >= 0
    if stands:
        assert EquilibriumTest(hyq_data, scene, LEGS, DOWN).holds(root)


def drawn_contacts(
    data: RobotData, scene: Scene, root: Array, rng: np.random.Generator
) -> tuple[Array, Array] | None:
    """Contact points and cones: a random point of a surface in each leg's workspace."""
    rotation = pin.Quaternion(root[3:7]).matrix()
    points, cones = [], []
    for k, limb in enumerate(data.robot.limbs):
        faces = ConvexHull(data.workspaces[k]).equations
        for _ in range(60):
            surface = scene.surfaces[int(rng.integers(len(scene.surfaces)))]
            a, b, _, d = surface.polygon.boundary
            point = a + rng.random() * (b - a) + rng.random() * (d - a)
            local = rotation.T @ (point + limb.radius * surface.normal - root[:3])
            if (faces[:, :3] @ local + faces[:, 3] <= 0).all():
                axes = np.column_stack([surface.polygon.plane.axes, surface.normal])
                points.append(point)
                cones.append(cone_generators(axes, surface.friction))
                break
    return (np.array(points), np.array(cones)) if len(points) >= 3 else None


def test_a_patch_bears_at_its_corners(talos_data: RobotData) -> None:
    """The centre of mass may lie outside the feet's centres by the size of the soles."""
    feet = tuple(limb.name for limb in talos_data.robot.limbs)
    ground = make_surface("g", [[-2, -2, 0], [2, -2, 0], [2, 2, 0], [-2, 2, 0]], 0.5)
    test = EquilibriumTest(talos_data, Scene([ground]), feet, DOWN)
    assert test.holds(at(0, 0, talos_data.height))
    lath = make_surface("l", [[-2, 0.5, 0], [2, 0.5, 0], [2, 0.52, 0], [-2, 0.52, 0]], 0.5)
    assert not EquilibriumTest(talos_data, Scene([lath]), feet, DOWN).holds(
        at(0, 0, talos_data.height)
    )


@pytest.mark.parametrize("count", [1, 7])
def test_an_edge_is_refused_where_nothing_bears(hyq_data: RobotData, count: int) -> None:
    scene = Scene([strip("left", 0.25, 0.6)])
    left = ("lf_leg", "lh_leg")
    test = EquilibriumTest(hyq_data, scene, left, DOWN)
    over, beside = at(0, 0.4, 0.6), at(0, 0.0, 0.6)
    aside = RootSegment(over, beside)
    assert Reachability(hyq_data, scene, left).edge_holds(aside, count)
    stricter = Reachability(hyq_data, scene, left, test)
    assert not stricter.edge_holds(aside, count)
    assert stricter.edge_holds(RootSegment(over, at(0.5, 0.4, 0.6)), count)
