"""Quadratic programs: three solvers, relaxed rows, and programs without a solution."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rbprm_core.errors import InvalidInput
from rbprm_core.posture.quadratic_program import SOLVERS, QuadraticProgram, solve, solve_relaxed

OTHERS = [name for name in SOLVERS if name != "daqp"]
seeds = st.integers(0, 2**32 - 1)


def program(seed: int, contradictory: bool = False) -> QuadraticProgram:
    """A random program with equalities, two-sided and one-sided rows, and bounds."""
    rng = np.random.default_rng(seed)
    size, rows = 12, 15
    root = rng.normal(size=(size, size))
    matrix = rng.normal(size=(rows, size)) * 10 ** rng.uniform(-1, 1, (rows, 1))
    values = matrix @ rng.uniform(-0.1, 0.1, size)
    lower, upper = values - rng.uniform(0, 0.2, rows), values + rng.uniform(0, 0.2, rows)
    lower[:4] = upper[:4] = values[:4]
    upper[4:8], lower[8:10] = np.inf, -np.inf
    if contradictory:
        lower[4:8] += 5.0
    return QuadraticProgram(
        hessian=np.eye(size) + 0.05 * root @ root.T,
        gradient=rng.normal(size=size),
        matrix=matrix,
        lower=lower,
        upper=upper,
        low=np.full(size, -0.3),
        high=np.full(size, 0.3),
    )


@pytest.mark.parametrize("solver", OTHERS)
@settings(max_examples=20)
@given(seeds)
def test_the_solvers_agree(solver: str, seed: int) -> None:
    given_program = program(seed)
    expected = solve(given_program)
    assert expected is not None
    assert solve(given_program, solver) == pytest.approx(expected, abs=1e-5)


@pytest.mark.parametrize("solver", OTHERS)
@settings(max_examples=20)
@given(seeds)
def test_the_solvers_relax_rows_alike(solver: str, seed: int) -> None:
    contradictory = program(seed, contradictory=True)
    expected = solve_relaxed(contradictory, 1e3)
    assert expected is not None
    assert solve_relaxed(contradictory, 1e3, solver) == pytest.approx(expected, abs=1e-4)


@settings(max_examples=20)
@given(seeds)
def test_at_a_high_price_rows_hold_where_they_can(seed: int) -> None:
    exact, relaxed = solve(program(seed)), solve_relaxed(program(seed), 1e8)
    assert exact is not None
    assert relaxed == pytest.approx(exact, abs=1e-5)


@pytest.mark.parametrize("solver", ["daqp", "proxqp"])
def test_without_a_solution_there_is_none(solver: str) -> None:
    one = np.ones((1, 1))
    impossible = QuadraticProgram(
        one, np.zeros(1), np.array([[1.0], [1.0]]), np.array([1.0, -np.inf]),
        np.array([np.inf, -1.0]), np.full(1, -9.0), np.full(1, 9.0),
    )  # fmt: skip
    assert solve(impossible, solver) is None


def test_an_unknown_solver_is_refused() -> None:
    with pytest.raises(InvalidInput, match="qp_solver"):
        solve(program(0), "simplex")
    with pytest.raises(InvalidInput, match="qp_solver"):
        solve_relaxed(program(0), 1.0, "simplex")
