"""Robustness b0 against a second linear program: HiGHS on the primal, as the definition has it.

The planner solves the dual with DAQP. Here the primal (8) of Tonneau et al. 2018 is written down
from its definition, about the world's origin, and solved by HiGHS. Contact sets are points and
patches in any orientation, on all sides of the robot, each with a friction of its own.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import assume, event, given, settings
from hypothesis import strategies as st
from scipy import sparse
from scipy.optimize import linprog

from rbprm_core.arrays import Array
from rbprm_core.statics import (
    GRIP_FORCE,
    Equilibrium,
    cone_generators,
    grip_robustness,
    robustness,
    robustness_gradient,
)

OPTIMAL, INFEASIBLE, UNBOUNDED = 0, 2, 3  # status of scipy's linprog
PRECISE = {"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10}
LARGE = 1e3  # times the weight: beyond, b0 is infinite up to rounding
STATES = 1200
MAX_SECONDS = 3.0  # of one core for all of them; about 0.2 s on an idle machine


@dataclass(frozen=True)
class Load:
    """Contacts of a robot and what they bear.

    Attributes:
        points: (e, 3) contact points, m.
        generators: (e, 4, 3) unit generators of the friction cones.
        com: (3,) centre of mass, m.
        weight: (3,) force of gravity, N.
    """

    points: Array
    generators: Array
    com: Array
    weight: Array

    def problem(self) -> Equilibrium:
        """The problem that the planner solves: 1 kg in a suitable gravity."""
        return Equilibrium.of(self.points, self.generators, self.com, 1.0, self.weight)

    def columns(self) -> Array:
        """(6, 4 e) unit forces along the generators and their moments about the origin."""
        forces = self.generators.reshape(-1, 3)
        moments = np.cross(np.repeat(self.points, 4, axis=0), forces)
        return np.vstack([forces.T, moments.T])

    def primal(self) -> float:
        """b0 in newtons by HiGHS: max b with G beta = w and beta >= b."""
        return self.size * max_min(*self.program())

    @property
    def size(self) -> float:
        """Largest component of the weight, N."""
        return float(np.abs(self.weight).max())

    def program(self) -> tuple[Array, Array]:
        """The equation G beta = w, in units of the weight."""
        wrench = -np.concatenate([self.weight, np.cross(self.com, self.weight)])
        return self.columns(), wrench / self.size

    def grip(self) -> float:
        """b0 in newtons by HiGHS where nothing weighs: the coefficients add up to the grip."""
        columns = self.columns()
        balance = np.vstack([columns, np.ones(columns.shape[1])])
        return GRIP_FORCE * max_min(balance, np.append(np.zeros(6), 1.0))

    def closed(self) -> bool:
        """Whether the contacts are in force closure: some beta >= 1 balances, and G has rank 6."""
        columns = self.columns()
        count = columns.shape[1]
        found = linprog(
            np.zeros(count), A_eq=columns, b_eq=np.zeros(6), bounds=(1.0, None), method="highs"
        )
        assert found.status in (OPTIMAL, INFEASIBLE)
        return bool(found.status == OPTIMAL and np.linalg.matrix_rank(columns, tol=1e-3) == 6)


def max_min(matrix: Array, target: Array) -> float:
    """Largest lower bound of the coefficients that solve an equation, by HiGHS."""
    status, values = solved([(matrix, target)])
    if status == OPTIMAL:
        return values[0]
    return -np.inf if status == INFEASIBLE else np.inf


def solved(programs: list[tuple[Array, Array]]) -> tuple[int, list[float]]:
    """Status and largest lower bounds of some equations, as one program of independent blocks."""
    equations = [sparse.csr_array(np.column_stack([a, np.zeros(len(a))])) for a, _ in programs]
    sizes = [a.shape[1] for a, _ in programs]
    bounds = [sparse.hstack([-sparse.eye_array(n), np.ones((n, 1))]) for n in sizes]
    found = linprog(
        np.concatenate([np.append(np.zeros(n), -1.0) for n in sizes]),
        A_ub=sparse.block_diag(bounds, format="csr"),
        b_ub=np.zeros(sum(sizes)),
        A_eq=sparse.block_diag(equations, format="csr"),
        b_eq=np.concatenate([target for _, target in programs]),
        bounds=(None, None),
        method="highs",
        options=PRECISE,
    )
    assert found.status in (OPTIMAL, INFEASIBLE, UNBOUNDED)
    if found.status != OPTIMAL:
        return found.status, []
    last = np.cumsum([n + 1 for n in sizes]) - 1
    return OPTIMAL, found.x[last].tolist()


def load_of(
    seed: int, points: int, patches: int, turn: float, frictions: tuple[float, ...]
) -> Load:
    """Random contacts, and a weight in a random direction.

    Args:
        seed: of the random numbers.
        points: number of point contacts.
        patches: number of rectangular patches, each with four contact points.
        turn: largest turn of a contact's normal away from the vertical about each axis, rad.
        frictions: coefficients of which each contact has one.
    """
    rng = np.random.default_rng(seed)
    places, cones = [], []
    for k in range(points + patches):
        rotation = pin.exp3(rng.uniform(-turn, turn, 3))
        middle = rng.uniform(-0.5, 0.5, 3) * [1.0, 1.0, 0.3]
        half = rng.uniform(0.02, 0.12, 2) if k >= points else np.zeros(2)
        signs = [(1, 1), (-1, 1), (-1, -1), (1, -1)] if k >= points else [(0, 0)]
        cone = cone_generators(rotation, rng.choice(frictions))
        for sign in signs:
            places.append(middle + rotation[:, :2] @ (half * sign))
            cones.append(cone)
    weight = 9.81 * rng.uniform(1.0, 100.0) * (pin.exp3(rng.normal(0.0, 0.2, 3)) @ [0.0, 0.0, -1.0])
    com = rng.uniform([-0.2, -0.2, 0.2], [0.2, 0.2, 0.9])
    return Load(np.array(places), np.array(cones), com, weight)


seeds = st.integers(0, 2**32 - 1)
counts = st.tuples(st.integers(0, 4), st.integers(0, 3)).filter(any)  # points and patches
turns = st.sampled_from([0.0, 0.3, 1.0, 3.0])
frictions = st.sampled_from([(0.0,), (0.1, 0.5), (0.5, 1.0), (1.5,)])


def kind(b0: float) -> str:
    """Sort of a value of b0."""
    if np.isinf(b0):
        return "unbounded" if b0 > 0 else "infeasible"
    return "in equilibrium" if b0 > 0 else "out of equilibrium"


@settings(max_examples=150)
@given(seed=seeds, count=counts, turn=turns, friction=frictions)
def test_with_weight(
    seed: int, count: tuple[int, int], turn: float, friction: tuple[float, ...]
) -> None:
    load = load_of(seed, *count, turn, friction)
    found, wanted = robustness(load.problem()), load.primal()
    event(kind(wanted))
    if abs(wanted) > LARGE * load.size:  # infinite, or nearly so
        assert found * np.sign(wanted) > LARGE
    else:
        # Without friction the dual is nearly degenerate, and the solver's tolerance shows.
        precision = 1e-5 if friction == (0.0,) else 1e-8
        assert found == pytest.approx(wanted, rel=max(precision, 1e-6), abs=precision * load.size)


@settings(max_examples=150)
@given(seed=seeds, count=counts, turn=turns, friction=frictions)
def test_without_weight(
    seed: int, count: tuple[int, int], turn: float, friction: tuple[float, ...]
) -> None:
    """The sign of b0 is that of force closure, and its size that of the second program."""
    load = load_of(seed, *count, turn, friction)
    found, wanted, closed = (
        grip_robustness(load.points, load.generators, GRIP_FORCE),
        load.grip(),
        load.closed(),
    )
    event("force closure" if closed else kind(wanted))
    if wanted < 1e-6 or not closed:
        assert found <= 1e-6
    if found > 1e-9:
        assert closed
        precision = 1e-5 if friction == (0.0,) else 1e-7
        assert found == pytest.approx(wanted, rel=1e-6, abs=precision * GRIP_FORCE)


@settings(max_examples=60)
@given(seed=seeds, count=counts, friction=frictions)
def test_gradient_bounds_b0_about_the_centre_of_mass(
    seed: int, count: tuple[int, int], friction: tuple[float, ...]
) -> None:
    load = load_of(seed, *count, 0.3, friction)
    b0, gradient = robustness_gradient(load.problem())
    assume(np.isfinite(b0))
    rng = np.random.default_rng(seed)
    shift = rng.uniform(-0.1, 0.1, 3)
    bound = b0 + float(gradient @ shift)
    assert replace(load, com=load.com + shift).primal() <= bound + 1e-6 * (1.0 + abs(bound))


def test_the_sample_has_loads_of_every_sort() -> None:
    weighted = {kind(load_of(seed, 2, 1, 1.0, (0.5,)).primal()) for seed in range(60)}
    weighted |= {kind(load_of(seed, 1, 0, 1.0, (0.5,)).primal()) for seed in range(5)}
    weighted |= {kind(load_of(seed, 4, 0, 3.0, (1.5,)).primal()) for seed in range(20)}
    assert weighted == {"in equilibrium", "out of equilibrium", "infeasible", "unbounded"}
    closed = [load_of(seed, 2, 1, 3.0, (1.0,)).closed() for seed in range(40)]
    assert any(closed)
    assert not all(closed)


def test_more_than_a_thousand_states() -> None:
    """Planner and second program agree on all; the planner's part takes little time."""
    loads = [
        load_of(seed, points, patches, 0.3, (0.3, 0.5, 1.0))
        for seed in range(STATES // 4)
        for points, patches in ((3, 0), (4, 0), (0, 2), (2, 1))
    ]
    start = time.process_time()
    found = [robustness(load.problem()) for load in loads]
    seconds = time.process_time() - start
    assert seconds < MAX_SECONDS
    assert len(found) == STATES
    assert STATES / 10 < sum(b0 > 0 for b0 in found) < STATES
    assert np.isfinite(found).all()
    for first in range(0, STATES, 50):  # together, since each call of HiGHS takes milliseconds
        some = loads[first : first + 50]
        status, values = solved([load.program() for load in some])
        assert status == OPTIMAL
        wanted = [load.size * value for load, value in zip(some, values, strict=True)]
        np.testing.assert_allclose(found[first : first + 50], wanted, rtol=1e-6, atol=1e-5)
