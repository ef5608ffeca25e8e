"""Robustness b0: the dual (9) of Tonneau et al. 2018 against the primal (8), and its physics."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from rbprm_core.arrays import Array
from rbprm_core.statics import Equilibrium, cone_generators, robustness, robustness_gradient

GRAVITY = np.array([0.0, 0.0, -9.81])
HYQ_MASS = 80.0
OPTIMAL, INFEASIBLE, UNBOUNDED = 0, 2, 3  # status of scipy's linprog

seeds = st.integers(0, 2**32 - 1)


class Stance:
    """Random contacts on level or tilted ground under a centre of mass."""

    def __init__(self, seed: int, count: int, tilt: float, friction: float) -> None:
        rng = np.random.default_rng(seed)
        self.points = rng.uniform(-0.5, 0.5, (count, 3)) * [1, 1, 0.3]
        turns = rng.uniform(-tilt, tilt, (count, 3))
        self.rotations = np.array([pin.exp3(turn) for turn in turns]).reshape(-1, 3, 3)
        self.generators = np.array([cone_generators(r, friction) for r in self.rotations]).reshape(
            -1, 4, 3
        )
        self.com = rng.uniform([-0.2, -0.2, 0.3], [0.2, 0.2, 0.7])

    def b0(self, mass: float = HYQ_MASS, place: pin.SE3 | None = None) -> float:
        place = pin.SE3.Identity() if place is None else place
        turn, shift = place.rotation, place.translation
        problem = Equilibrium.of(
            self.points @ turn.T + shift,
            self.generators @ turn.T,
            turn @ self.com + shift,
            mass,
            turn @ GRAVITY,
        )
        return robustness(problem)

    def primal(self, mass: float = HYQ_MASS) -> float:
        """b0 by the primal (8) of Tonneau et al. 2018, moments about the world's origin."""
        columns = [
            np.concatenate([ray, np.cross(point, ray)])
            for point, rays in zip(self.points, self.generators, strict=True)
            for ray in rays
        ]
        count = len(columns)
        weight = mass * GRAVITY
        wrench = -np.concatenate([weight, np.cross(self.com, weight)])
        size = np.abs(wrench).max()
        found = linprog(
            np.append(np.zeros(count), -1.0),
            A_ub=np.hstack([-np.eye(count), np.ones((count, 1))]),
            b_ub=np.zeros(count),
            A_eq=np.column_stack([*columns, np.zeros(6)]),
            b_eq=wrench / size,
            bounds=(None, None),
            method="highs",
        )
        assert found.status in (OPTIMAL, INFEASIBLE, UNBOUNDED)
        if found.status == OPTIMAL:
            return float(-found.fun * size)
        return -np.inf if found.status == INFEASIBLE else np.inf


@settings(max_examples=300)
@given(
    seed=seeds,
    count=st.integers(1, 5),
    tilt=st.sampled_from([0.0, 0.2, 0.6, 1.0]),
    friction=st.sampled_from([0.0, 0.1, 0.5, 1.0]),
)
def test_dual_equals_primal(seed: int, count: int, tilt: float, friction: float) -> None:
    stance = Stance(seed, count, tilt, friction)
    wanted = stance.primal()
    assume(wanted < np.inf)
    assert stance.b0() == pytest.approx(wanted, rel=1e-6, abs=1e-5)


@pytest.mark.parametrize(("seed", "tilt", "friction"), [(37, 1.0, 2.0), (0, 3.0, 1.0)])
def test_two_contacts_that_hold_nothing(seed: int, tilt: float, friction: float) -> None:
    stance = Stance(seed, 2, tilt, friction)
    assert stance.primal() == -np.inf
    assert stance.b0() == -np.inf


def test_two_feet_wedged_between_walls_may_press_as_they_like() -> None:
    walls = [np.column_stack([[0, 1, 0], [0, 0, 1], [s, 0, 0]]) for s in (1.0, -1.0)]
    points = np.array([[s * 0.5, y, 0] for s in (-1, 1) for y in (-0.2, 0.2)])
    generators = np.array([cone_generators(w, 0.5) for w in walls for _ in range(2)])
    problem = Equilibrium.of(points, generators, np.zeros(3), HYQ_MASS, GRAVITY)
    assert robustness(problem) > 1e3  # the walls can be pressed apart without bound


def test_the_sample_has_stances_of_every_sort() -> None:
    values = [Stance(seed, 3, 0.3, 0.5).primal() for seed in range(40)]
    assert any(v > 0 for v in values)
    assert any(np.isfinite(v) and v < 0 for v in values)
    assert Stance(0, 1, 0.0, 0.5).primal() == -np.inf
    assert Stance(6, 4, 1.0, 1.0).primal() == np.inf


@given(seeds, st.integers(3, 5), st.floats(0.01, 1000))
def test_b0_scales_with_the_mass(seed: int, count: int, factor: float) -> None:
    stance = Stance(seed, count, 0.3, 0.5)
    assert stance.b0(factor * HYQ_MASS) == pytest.approx(factor * stance.b0(), rel=1e-6, abs=1e-6)


@given(seeds, seeds, st.integers(3, 5))
def test_b0_does_not_depend_on_where_in_the_world(seed: int, place: int, count: int) -> None:
    rng = np.random.default_rng(place)
    moved = pin.SE3(pin.exp3(rng.uniform(-2, 2, 3)), rng.uniform(-100, 100, 3))
    stance = Stance(seed, count, 0.3, 0.5)
    assert stance.b0(place=moved) == pytest.approx(stance.b0(), rel=1e-6, abs=1e-5)


@given(seeds, st.integers(2, 5), seeds)
def test_the_order_of_contacts_does_not_matter(seed: int, count: int, shuffle: int) -> None:
    stance = Stance(seed, count, 0.3, 0.5)
    before = stance.b0()
    order = np.random.default_rng(shuffle).permutation(count)
    stance.points, stance.generators = stance.points[order], stance.generators[order]
    assert stance.b0() == pytest.approx(before, rel=1e-6, abs=1e-6)


def standing(com: Array, friction: float = 0.5) -> float:
    """b0 in newtons on four points of level ground, corners of a 0.8 m x 0.6 m rectangle."""
    points = np.array([[x, y, 0] for x in (-0.4, 0.4) for y in (-0.3, 0.3)])
    generators = np.array([cone_generators(np.eye(3), friction)] * 4)
    return robustness(Equilibrium.of(points, generators, com, HYQ_MASS, GRAVITY))


def test_a_table_shares_its_weight_evenly() -> None:
    # By symmetry 16 generators with equal coefficients: m g sqrt(1 + mu^2) / 16 each.
    even = HYQ_MASS * 9.81 * np.sqrt(1.25) / 16
    assert standing(np.array([0, 0, 0.5])) == pytest.approx(even)
    assert standing(np.array([0, 0, 5.0])) == pytest.approx(even)


def test_the_sign_tells_inside_from_outside_the_support_polygon() -> None:
    assert standing(np.array([0.3, 0, 0.5])) > 0
    assert standing(np.array([0.4, 0, 0.5])) == pytest.approx(0, abs=1e-6)
    assert standing(np.array([0.5, 0, 0.5])) < 0
    nearer = [standing(np.array([x, 0, 0.5])) for x in (0.0, 0.1, 0.2, 0.3, 0.5, 0.7)]
    assert nearer == sorted(nearer, reverse=True)


def test_without_friction_a_table_stands_and_a_slope_does_not_hold() -> None:
    assert standing(np.array([0, 0, 0.5]), friction=0.0) > 0
    tilt = pin.exp3(np.array([0.3, 0, 0]))
    points = np.array([[x, y, 0] for x in (-0.4, 0.4) for y in (-0.3, 0.3)]) @ tilt.T
    for friction, holds in ((0.0, False), (0.2, False), (0.6, True)):
        generators = np.array([cone_generators(tilt, friction)] * 4)
        problem = Equilibrium.of(points, generators, tilt @ [0, 0, 0.3], HYQ_MASS, GRAVITY)
        assert (robustness(problem) > 0) == holds  # tan 0.3 = 0.31


def test_one_foot_beside_the_weight_cannot_hold_it() -> None:
    one = cone_generators(np.eye(3), 0.5)[None]
    beside = Equilibrium.of(np.zeros((1, 3)), one, np.array([1.0, 0, 1]), HYQ_MASS, GRAVITY)
    assert robustness(beside) == -np.inf


def test_without_contacts_nothing_holds() -> None:
    none = Equilibrium.of(np.zeros((0, 3)), np.zeros((0, 4, 3)), np.zeros(3), HYQ_MASS, GRAVITY)
    assert robustness(none) == -np.inf


def test_a_squeeze_without_bound_is_infinite() -> None:
    walls = [np.column_stack([[0, 1, 0], [0, 0, 1], [s, 0, 0]]) for s in (1.0, -1.0)]
    points = np.array([[s * 0.5, y, 0] for s in (-1, 1) for y in (-0.2, 0.2)])
    generators = np.array([cone_generators(w, 10.0) for w in walls for _ in range(2)])
    problem = Equilibrium.of(points, generators, np.zeros(3), HYQ_MASS, GRAVITY)
    assert robustness(problem) == np.inf


@given(seeds, st.integers(2, 5), st.floats(0.0, 0.6), st.floats(0.1, 1.0))
def test_the_gradient_bounds_b0_of_other_centres_of_mass(
    seed: int, count: int, tilt: float, friction: float
) -> None:
    """The dual solution stays feasible: b0 is at most its linear model, everywhere."""
    stance = Stance(seed, count, tilt, friction)
    here = stance.com

    def problem() -> Equilibrium:
        return Equilibrium.of(stance.points, stance.generators, stance.com, HYQ_MASS, GRAVITY)

    b0, gradient = robustness_gradient(problem())
    assert b0 == robustness(problem())
    assume(np.isfinite(b0))
    rng = np.random.default_rng(seed)
    for size in (1e-4, 0.01, 0.1, 1.0):
        stance.com = here + rng.uniform(-size, size, 3)
        bound = b0 + gradient @ (stance.com - here)
        assert robustness(problem()) <= bound + 1e-6 * max(1.0, abs(bound))


def test_b0_that_is_not_finite_has_no_gradient() -> None:
    none = Equilibrium(np.zeros((6, 0)), np.array([0, 0, 800.0, 0, 0, 0]))
    b0, gradient = robustness_gradient(none)
    assert b0 == -np.inf
    assert np.isnan(gradient).all()
