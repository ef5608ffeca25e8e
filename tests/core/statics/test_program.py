"""The solver on degenerate contacts as people draw them: along the axes, on lines, in one point."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from rbprm_core.check.statics import robustness as checked
from rbprm_core.statics import Equilibrium, cone_generators, robustness
from rbprm_core.statics.program import largest_least

Array = NDArray[np.float64]
GRAVITY = np.array([0.0, 0.0, -9.81])


@settings(max_examples=120)
@given(
    seed=st.integers(0, 2**32 - 1),
    count=st.integers(1, 4),
    size=st.sampled_from([0.01, 0.3, 1.0]),
    friction=st.sampled_from([0.0, 0.5, 1.0]),
)
def test_contacts_along_the_axes_as_the_check_sees_them(
    seed: int, count: int, size: float, friction: float
) -> None:
    rng = np.random.default_rng(seed)
    points = size * rng.integers(-1, 2, size=(count, 3)).astype(float)
    frames = [np.roll(np.eye(3), k, axis=1) for k in rng.integers(0, 3, count)]
    signs = rng.choice([-1, 1], count)
    frames = [frame @ np.diag([1, s, s]) for frame, s in zip(frames, signs, strict=True)]
    generators = np.array([cone_generators(frame, friction) for frame in frames])
    ours = robustness(Equilibrium.of(points, generators, np.zeros(3), 1.0, GRAVITY))
    edges = generators.reshape(-1, 3)
    theirs = checked(np.repeat(points, 4, axis=0), edges, np.zeros(3), GRAVITY)
    assert ours == pytest.approx(theirs, rel=1e-5, abs=1e-4)


def test_equations_that_repeat_and_contradict_each_other() -> None:
    row = np.array([1.0, 1.0, 1.0, 1.0])
    assert largest_least(np.stack([row, row]), np.array([1.0, 1.0])) == pytest.approx(0.25)
    assert largest_least(np.stack([row, row]), np.array([1.0, 0.5])) == -np.inf


def test_a_bound_that_is_none() -> None:
    assert largest_least(np.array([[1.0, -1.0]]), np.array([0.0])) == np.inf
