"""Robustness without weight: known grasps, the symmetries of mechanics, the independent check."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from rbprm_core.arrays import Array
from rbprm_core.check.static_equilibrium import generators as check_generators
from rbprm_core.check.static_equilibrium import grip_robustness as checked_grip
from rbprm_core.check.static_equilibrium import robustness
from rbprm_core.errors import InvalidInput
from rbprm_core.statics import Equilibrium, cone_generators, grip_robustness
from rbprm_core.statics import robustness as weighted_robustness

FORCE = 10.0

seeds = st.integers(0, 2**32 - 1)


class Grasp:
    """Contact points with unit normals in the directions in which the contacts push."""

    def __init__(self, points: Array, normals: Array, friction: float) -> None:
        self.points = np.array(points, dtype=float)
        self.normals = np.array(normals, dtype=float)
        self.normals /= np.linalg.norm(self.normals, axis=1)[:, None]
        frames = [frame_on(normal) for normal in self.normals]
        self.generators = np.array([cone_generators(frame, friction) for frame in frames])

    def b0(self, force: float = FORCE, place: pin.SE3 | None = None, size: float = 1.0) -> float:
        place = pin.SE3.Identity() if place is None else place
        points = size * self.points @ place.rotation.T + place.translation
        return grip_robustness(points, self.generators @ place.rotation.T, force)

    def checked(self) -> float:
        """b0 in newtons as the independent check computes it."""
        return checked_grip(
            np.repeat(self.points, 4, axis=0), self.generators.reshape(-1, 3), FORCE
        )


def frame_on(normal: Array) -> Array:
    side = np.cross(normal, np.eye(3)[int(np.argmin(np.abs(normal)))])
    side /= np.linalg.norm(side)
    return np.column_stack([side, np.cross(normal, side), normal])


def around_a_ball(seed: int, count: int, friction: float) -> Grasp:
    """Random contacts on a sphere that push roughly towards its centre."""
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(count, 3))
    normals = -points / np.linalg.norm(points, axis=1)[:, None] + 0.3 * rng.normal(size=(count, 3))
    return Grasp(points, normals, friction)


def prism_grasp(friction: float) -> Grasp:
    """Two fingers on one side of a bar and a thumb on the other, between them."""
    points = np.array([[0.01, -0.02, 0], [0.01, 0.02, 0], [-0.01, 0, 0]])
    return Grasp(points, np.array([[-1, 0, 0], [-1, 0, 0], [1, 0, 0]]), friction)


def tripod(friction: float) -> Grasp:
    """Three contacts around a disc."""
    angles = 2 * np.pi * np.arange(3) / 3
    points = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(3)])
    return Grasp(points, -points, friction)


def test_three_contacts_with_friction_around_a_disc_are_in_force_closure() -> None:
    assert tripod(0.5).b0() == pytest.approx(FORCE / 12)  # every ray carries the same
    assert tripod(0.5).checked() == pytest.approx(FORCE / 12)


def test_three_fingers_hold_a_bar() -> None:
    # The thumb carries half of the grip force: an eighth on each of its four generators. Each
    # generator of the two fingers carries a sixteenth.
    assert prism_grasp(0.5).b0() == pytest.approx(FORCE / 16)


def test_two_opposed_contacts_cannot_resist_a_moment_about_their_line() -> None:
    pair = Grasp(np.array([[1, 0, 0], [-1, 0, 0]]), np.array([[-1, 0, 0], [1, 0, 0]]), 0.5)
    assert pair.b0() == 0.0
    assert pair.checked() == 0.0
    # With weight, however small, the program is unbounded.
    squeezed = robustness(
        np.repeat(pair.points, 4, axis=0), pair.generators.reshape(-1, 3), [0, 0, 0], [0, 0, -1e-9]
    )
    assert squeezed == np.inf


def test_contacts_nearly_on_a_line_are_not_in_force_closure() -> None:
    points = np.array([[1, 0, 0], [-1, 0, 0], [-1, 1e-5, 0]])
    grasp = Grasp(points, np.array([[-1, 0, 0], [1, 0, 0], [1, 0, 0]]), 0.5)
    assert grasp.b0() == grasp.checked() == 0.0


def test_three_contacts_without_friction_are_not_in_force_closure() -> None:
    assert tripod(0.0).b0() == pytest.approx(0.0, abs=1e-9)
    assert tripod(0.0).checked() <= 1e-9


def test_seven_contacts_without_friction_hold_a_box() -> None:
    """Form closure: at least seven frictionless contacts are needed to hold a body in space."""
    points = [[1, 0.5, 0.2], [1, -0.5, 0.1], [-1, 0.1, 0.7], [0.3, 1, 0.4], [-0.4, 1, -0.6]]
    normals = [[-1, 0, 0], [-1, 0, 0], [1, 0, 0], [0, -1, 0], [0, -1, 0]]
    points += [[0.1, -1, 0.2], [0.6, 0.1, 1], [-0.5, 0.4, 1], [-0.2, -0.7, 1], [0.1, 0.1, -1]]
    normals += [[0, 1, 0], [0, 0, -1], [0, 0, -1], [0, 0, -1], [0, 0, 1]]
    box = Grasp(np.array(points), np.array(normals), 0.0)
    assert box.b0() == pytest.approx(box.checked(), abs=1e-6)
    fewer = Grasp(np.array(points[:6]), np.array(normals[:6]), 0.0)
    assert fewer.b0() <= 0.0


def test_contacts_that_push_to_one_side_hold_nothing() -> None:
    table = np.array([[x, y, 0] for x in (-0.4, 0.4) for y in (-0.3, 0.3)])
    one_sided = Grasp(table, np.tile([0, 0, 1], (4, 1)), 0.5)
    assert one_sided.b0() == -np.inf
    tilted = Grasp(table, np.array([[1, 1, 1], [1, -1, 1], [-1, 1, 1], [-1, -1, 1]]), 0.5)
    assert tilted.b0() < 0
    assert tilted.checked() < 0


def test_one_contact_or_none_hold_nothing() -> None:
    one = Grasp(np.zeros((1, 3)), np.array([[0, 0, 1]]), 0.5)
    assert one.b0() == -np.inf
    assert one.checked() == -np.inf
    assert grip_robustness(np.zeros((0, 3)), np.zeros((0, 4, 3)), FORCE) == -np.inf
    assert checked_grip([], [], FORCE) == -np.inf


@settings(max_examples=60)
@given(seeds, st.integers(2, 6), st.sampled_from([0.0, 0.2, 0.5, 1.0]))
def test_the_check_agrees(seed: int, count: int, friction: float) -> None:
    grasp = around_a_ball(seed, count, friction)
    ours, theirs = grasp.b0(), grasp.checked()
    if ours > -100 * FORCE:  # far from closure the check may return minus infinity
        assert ours == pytest.approx(theirs, abs=1e-5 * FORCE)
    else:
        assert theirs < -50 * FORCE


@settings(max_examples=40)
@given(seeds, seeds, st.integers(3, 5), st.floats(0.01, 100))
def test_neither_size_nor_place_matter(seed: int, place: int, count: int, size: float) -> None:
    rng = np.random.default_rng(place)
    moved = pin.SE3(pin.exp3(rng.uniform(-2, 2, 3)), rng.uniform(-10, 10, 3))
    grasp = around_a_ball(seed, count, 0.5)
    assert grasp.b0(place=moved, size=size) == pytest.approx(grasp.b0(), rel=1e-5, abs=1e-6)


@settings(max_examples=40)
@given(seeds, st.integers(3, 5), st.floats(0.01, 1000))
def test_b0_is_proportional_to_the_grip(seed: int, count: int, factor: float) -> None:
    grasp = around_a_ball(seed, count, 0.5)
    assert grasp.b0(factor * FORCE) == pytest.approx(factor * grasp.b0(), rel=1e-6, abs=1e-9)


@settings(max_examples=40)
@given(seeds, st.integers(3, 6), seeds)
def test_the_order_of_contacts_does_not_matter(seed: int, count: int, shuffle: int) -> None:
    grasp = around_a_ball(seed, count, 0.5)
    order = np.random.default_rng(shuffle).permutation(count)
    shuffled = Grasp(grasp.points[order], grasp.normals[order], 0.5)
    assert shuffled.b0() == pytest.approx(grasp.b0(), rel=1e-6, abs=1e-6)


@settings(max_examples=40)
@given(seeds, st.integers(3, 6))
def test_b0_is_at_most_an_even_share(seed: int, count: int) -> None:
    assert around_a_ball(seed, count, 0.7).b0() <= FORCE / (4 * count) + 1e-9


@settings(max_examples=20)
@example(11966, 3)
@given(seeds, st.integers(3, 5))
def test_force_closure_resists_every_wrench(seed: int, count: int) -> None:
    """By definition, b0 is positive exactly where forces in the cones balance any load."""
    grasp = around_a_ball(seed, count, 0.5)
    rng = np.random.default_rng(seed)
    arms = np.repeat(grasp.points, 4, axis=0)
    edges = grasp.generators.reshape(-1, 3)
    held = []
    for load in rng.normal(size=(12, 3)):
        # A load at a random point: a random wrench but for its pitch.
        b0 = robustness(arms, edges, 3 * rng.normal(size=3), load)
        held.append(b0 >= -1e-6)
    if grasp.b0() > 1e-9:  # 1e-16 is rounding, as for 3 points with seed 11966
        assert all(held)
    elif grasp.b0() < -1e-9:
        assert not all(held)


def test_the_same_rays_as_the_check() -> None:
    frame = frame_on(np.array([0.6, 0.0, 0.8]))
    theirs = check_generators(frame[:, 2], frame[:, 0], 0.5)
    assert cone_generators(frame, 0.5) == pytest.approx(theirs)


def test_the_program_with_weight_refuses_to_answer_without() -> None:
    grasp = tripod(0.5)
    problem = Equilibrium.of(grasp.points, grasp.generators, np.zeros(3), 1.0, np.zeros(3))
    with pytest.raises(InvalidInput, match="gravity"):
        weighted_robustness(problem)
