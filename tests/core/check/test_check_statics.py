"""Robustness of the check against closed forms, its dual, and the symmetries of mechanics."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog
from scipy.spatial.transform import Rotation

from rbprm_core.arrays import Array
from rbprm_core.check.static_equilibrium import (
    force_closure_violations,
    generators,
    robustness,
    state_robustness,
    tangent,
    weight,
)
from rbprm_core.plan_record import ContactEntry

Contacts = tuple[Array, Array]
MASS = 80.0
LOAD = np.array([0.0, 0.0, -9.81 * MASS])
RELATIVE = 1e-6 * 9.81 * MASS  # newtons; the tolerance of the check itself

lengths = st.floats(0.1, 1.0)
frictions = st.floats(0.1, 1.2)
seeds = st.integers(0, 2**32 - 1)


def flat(points: list[list[float]], friction: float) -> Contacts:
    """Points (4 k, 3) and edges (4 k, 3) of k contacts on level ground."""
    pyramid = generators([0, 0, 1], [1, 0, 0], friction)
    return np.repeat(np.array(points), 4, axis=0), np.tile(pyramid, (len(points), 1))


def random_contacts(seed: int) -> tuple[Array, Array, Array]:
    """Points, edges and centre of mass of four slightly tilted contacts around it."""
    rng = np.random.default_rng(seed)
    corners = [[0.4, 0.3, 0], [0.4, -0.3, 0], [-0.4, 0.3, 0], [-0.4, -0.3, 0]]
    points, edges = [], []
    for corner in corners:
        normal = np.array([*rng.uniform(-0.3, 0.3, 2), 1.0])
        normal /= np.linalg.norm(normal)
        t1 = np.cross([0, 1, 0], normal)
        edges.append(generators(normal, t1 / np.linalg.norm(t1), rng.uniform(0.4, 0.9)))
        points += [np.array(corner) + rng.uniform(-0.1, 0.1, 3)] * 4
    return np.array(points), np.vstack(edges), np.array([*rng.uniform(-0.1, 0.1, 2), 0.5])


def test_generators_are_unit_and_on_the_cone() -> None:
    edges = generators([0, 0, 2], [1, 0, 0], 0.5)
    assert np.allclose(np.linalg.norm(edges, axis=1), 1)
    assert np.allclose(np.linalg.norm(edges[:, :2], axis=1) / edges[:, 2], 0.5)
    assert np.allclose(edges[:, :2].sum(axis=0), 0)


@given(a=lengths, b=lengths, height=lengths, friction=frictions)
@settings(max_examples=40, deadline=None)
def test_symmetric_stance_shares_the_weight(
    a: float, b: float, height: float, friction: float
) -> None:
    points = [[a, b, 0], [a, -b, 0], [-a, b, 0], [-a, -b, 0]]
    b0 = robustness(*flat(points, friction), [0, 0, height], LOAD)
    # All sixteen forces are equal; the vertical part of each is 1 / sqrt(1 + mu^2) of it.
    assert b0 == pytest.approx(9.81 * MASS * np.hypot(1, friction) / 16, abs=RELATIVE)


@given(seed=seeds, factor=st.floats(0.01, 100))
@settings(max_examples=30, deadline=None)
def test_b0_scales_with_the_mass(seed: int, factor: float) -> None:
    points, edges, com = random_contacts(seed)
    b0 = robustness(points, edges, com, LOAD)
    scaled = robustness(points, edges, com, factor * LOAD)
    assert scaled == pytest.approx(factor * b0, abs=2 * factor * RELATIVE)


@given(seed=seeds, vector=st.tuples(*[st.floats(-3, 3)] * 3), size=st.floats(0.2, 5))
@settings(max_examples=30, deadline=None)
def test_b0_does_not_depend_on_pose_and_size(
    seed: int, vector: tuple[float, float, float], size: float
) -> None:
    points, edges, com = random_contacts(seed)
    turn = Rotation.from_rotvec(vector)
    shift = np.array(vector) * 10
    moved = robustness(
        size * turn.apply(points) + shift,
        turn.apply(edges),
        size * turn.apply(com) + shift,
        turn.apply(LOAD),
    )
    assert moved == pytest.approx(robustness(points, edges, com, LOAD), abs=2 * RELATIVE)


@given(seed=seeds)
@settings(max_examples=30, deadline=None)
def test_the_dual_has_the_same_value(seed: int) -> None:
    points, edges, com = random_contacts(seed)
    # min w . y s.t. y . g_k >= 0, sum_k y . g_k = 1, with moments about the planning frame's origin
    wrenches = np.vstack((edges.T, np.cross(points, edges).T))
    target = -np.concatenate((LOAD, np.cross(com, LOAD)))
    answer = linprog(
        -target / np.linalg.norm(LOAD),
        A_ub=wrenches.T,
        b_ub=np.zeros(len(points)),
        A_eq=-wrenches.sum(axis=1)[None],
        b_eq=[1.0],
        bounds=[(None, None)] * 6,
    )
    assert answer.status == 0
    dual = answer.fun * np.linalg.norm(LOAD)
    assert robustness(points, edges, com, LOAD) == pytest.approx(dual, abs=3 * RELATIVE)


@given(seed=seeds)
@settings(max_examples=30, deadline=None)
def test_one_more_contact_point_never_beats_the_mean(seed: int) -> None:
    rng = np.random.default_rng(seed)
    points = [[*rng.uniform(-0.5, 0.5, 2), 0.0] for _ in range(6)]
    b0 = robustness(*flat(points, 0.5), [0, 0, 0.5], LOAD)
    assert b0 <= 9.81 * MASS * np.hypot(1, 0.5) / 24 + RELATIVE


def test_beyond_the_support_nothing_holds() -> None:
    square = [[0.2, 0.2, 0], [0.2, -0.2, 0], [-0.2, 0.2, 0], [-0.2, -0.2, 0]]
    assert robustness(*flat(square, 0.5), [0.19, 0, 0.5], LOAD) > 0
    assert robustness(*flat(square, 0.5), [0.2, 0, 0.5], LOAD) == pytest.approx(0, abs=RELATIVE)
    assert robustness(*flat(square, 0.5), [0.21, 0, 0.5], LOAD) < 0


def test_no_contact_and_a_lone_foot_do_not_hold() -> None:
    assert robustness([], [], [0, 0, 0.5], LOAD) == -np.inf
    assert robustness(*flat([[0.3, 0, 0]], 0.5), [0, 0, 0.5], LOAD) == -np.inf


def test_a_slope_holds_up_to_the_friction_angle() -> None:
    square = [[0.2, 0.2, 0], [0.2, -0.2, 0], [-0.2, 0.2, 0], [-0.2, -0.2, 0]]
    for slope, holds in ((0.98, True), (1.02, False)):
        angle = slope * np.arctan(0.5)
        load = 9.81 * MASS * np.array([np.sin(angle), 0, -np.cos(angle)])
        assert (robustness(*flat(square, 0.5), [0, 0, 0.01], load) > 0) == holds


def test_force_closure_is_without_bound() -> None:
    corners = [[x, y, z] for z in (0.0, 1.0) for x in (0.2, -0.2) for y in (0.2, -0.2)]
    up = generators([0, 0, 1], [1, 0, 0], 0.5)
    edges = np.vstack([up] * 4 + [-up] * 4)
    points = np.repeat(np.array(corners), 4, axis=0)
    assert robustness(points, edges, [0, 0, 0.5], LOAD) == np.inf


def contact(orientation: tuple[float, float, float, float]) -> ContactEntry:
    return ContactEntry(
        limb="leg",
        frame="foot",
        type="point",
        position=(0, 0, 0),
        orientation=orientation,
        normal=(0, 0, 1),
        points=((0, 0, 0),),
        friction=0.5,
    )


def test_tangents_follow_the_contact_frame_where_it_stands_on_the_normal() -> None:
    half = np.deg2rad(40) / 2
    t1, fixed = tangent(contact((0, 0, float(np.sin(half)), float(np.cos(half)))))
    assert fixed
    assert t1 == pytest.approx([np.cos(2 * half), np.sin(2 * half), 0])
    t1, fixed = tangent(contact((float(np.sin(half)), 0, 0, float(np.cos(half)))))
    assert not fixed
    assert abs(t1[2]) < 1e-12


def test_a_contact_counts_once_for_each_point() -> None:
    four = ContactEntry.model_validate(
        {
            **contact((0, 0, 0, 1)).model_dump(),
            "type": "planar",
            "points": [[0.1, 0.1, 0], [-0.1, 0.1, 0], [-0.1, -0.1, 0], [0.1, -0.1, 0]],
        }
    )
    b0, fixed = state_robustness([four], [0, 0, 1], LOAD)
    assert fixed
    assert b0 == pytest.approx(9.81 * MASS * np.hypot(1, 0.5) / 16, abs=RELATIVE)


def test_weight_is_mass_times_gravity() -> None:
    assert weight(2.0, (0, 0, -10)).tolist() == [0, 0, -20]
    assert weight(2.0, (0, 0, 0)).tolist() == [0, 0, 0]


def pressing(position: list[float], towards: list[float]) -> ContactEntry:
    """A point contact that pushes in a direction."""
    turn, _ = Rotation.align_vectors([towards], [[0, 0, 1]])
    return ContactEntry.model_validate(
        {
            **contact((0, 0, 0, 1)).model_dump(),
            "position": position,
            "orientation": turn.as_quat().tolist(),
            "normal": towards,
            "points": [position],
        }
    )


def test_without_weight_b0_is_that_of_the_grip() -> None:
    grasp = [
        pressing([0.01, -0.02, 0], [-1, 0, 0]),
        pressing([0.01, 0.02, 0], [-1, 0, 0]),
        pressing([-0.01, 0, 0], [1, 0, 0]),
    ]
    none = np.zeros(3)
    assert state_robustness(grasp, none, none, 8.0)[0] == pytest.approx(0.5)
    assert state_robustness(grasp[1:], none, none, 8.0)[0] < 0  # not opposed
    assert state_robustness(grasp[:2], none, none, 8.0)[0] == -np.inf


@given(seeds, st.sampled_from([1e-4, 1e-3, 1e-2, 10.0]), st.floats(-9, -3))
@settings(max_examples=60, deadline=None)
def test_contacts_of_hardly_any_friction_that_do_not_close(
    seed: int, friction: float, tilt: float
) -> None:
    """HiGHS ended one in ten of these problems with "status unknown"."""
    rng = np.random.default_rng(seed)
    table = [[*rng.uniform(-0.5, 0.5, 2), 0.0] for _ in range(rng.integers(2, 6))]
    normals = [[*rng.uniform(-1, 1, 2) * 10**tilt, 1.0] for _ in table]
    grasp = [pressing(point, normal) for point, normal in zip(table, normals, strict=True)]
    grasp = [contact.model_copy(update={"friction": friction}) for contact in grasp]
    assert state_robustness(grasp, np.zeros(3), np.zeros(3), 8.0)[0] < 0


@pytest.mark.parametrize(("b0", "closed"), [(0.1, True), (0.0, False), (-np.inf, False)])
def test_a_state_without_weight_has_to_be_in_force_closure(b0: float, closed: bool) -> None:
    assert (list(force_closure_violations(b0, 3, 8.0)) == []) == closed


@given(seeds)
def test_two_points_hold_only_what_is_over_the_line_through_them(seed: int) -> None:
    rng = np.random.default_rng(seed)
    first, second = rng.uniform(-0.5, 0.5, (2, 3)) * (1, 1, 0.1)
    points, edges = flat([first.tolist(), second.tolist()], 0.5)
    aside = rng.uniform(0.01, 0.3) * np.cross(second - first, [0, 0, 1])
    com = first + rng.uniform(0.1, 0.9) * (second - first) + [0, 0, 0.6]
    assert robustness(points, edges, com, LOAD) > -np.inf
    assert robustness(points, edges, com + aside, LOAD) == -np.inf


def test_two_points_for_which_the_solver_alone_gives_no_answer() -> None:
    """From a plan: HiGHS ended this infeasible problem with "status unknown"."""
    points = [[-0.51135904, 0.5316359, 0.20000003], [0.3941159, -0.677206, 0.19999998]]
    pyramid = generators([0, 0, 1], [2.220446049250313e-16, -1, 0], 0.5)
    where, edges = np.repeat(np.array(points), 4, axis=0), np.tile(pyramid, (2, 1))
    assert robustness(where, edges, [0.06816047, 0.00501703, 0.73732315], LOAD) == -np.inf
