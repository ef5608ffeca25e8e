"""The solver on degenerate contacts of scenarios made by hand: on axes, lines, in a point."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rbprm_core.check.static_equilibrium import generators
from rbprm_core.check.static_equilibrium import robustness as checked
from rbprm_core.statics import Equilibrium, cone_generators, robustness
from rbprm_core.statics.linear_program import max_min_coefficient

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
    if friction == 0 and max(ours, theirs) < 0:
        return  # how strongly contacts would have to pull is ill-conditioned without friction
    assert ours == pytest.approx(theirs, rel=1e-5, abs=1e-4 if friction > 0 else 1e-3)


@settings(max_examples=200)
@given(
    seed=st.integers(0, 2**32 - 1),
    count=st.integers(1, 6),
    friction=st.sampled_from([0.0, 1e-12, 1e-7, 1e-5, 1e-4, 1e-3, 0.5, 10.0]),
    tilt=st.sampled_from([0.0, 1e-12, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 0.01, 0.3]),
)
def test_hardly_any_friction_on_ground_that_is_hardly_tilted(
    seed: int, count: int, friction: float, tilt: float
) -> None:
    rng = np.random.default_rng(seed)
    points = rng.uniform(-0.5, 0.5, (count, 3)) * [1, 1, rng.choice([0.0, 0.3])]
    com = rng.uniform([-0.1, -0.1, 0.3], [0.1, 0.1, 0.7])
    turns = rng.uniform(-tilt, tilt, (count, 3)) + [0, 0, 1] * rng.uniform(-3, 3, (count, 1))
    frames = [pin.exp3(turn) for turn in turns]
    rays = np.array([cone_generators(frame, friction) for frame in frames])
    edges = np.concatenate([generators(frame[:, 2], frame[:, 0], friction) for frame in frames])
    ours = robustness(Equilibrium.of(points, rays, com, 1.0, GRAVITY))
    theirs = checked(np.repeat(points, 4, axis=0), edges, com, GRAVITY)
    if max(ours, theirs) < 0:
        return
    assert ours == pytest.approx(theirs, abs=1e-4 * 9.81)


@pytest.mark.parametrize(("tilt", "holds"), [(0.0, True), (1e-7, True), (3e-4, False)])
def test_a_table_without_friction(tilt: float, holds: bool) -> None:
    """Planner and check agree that it holds where it is level up to the rounding of a mesh."""
    points = np.array([[x, y, 0] for x in (-0.4, 0.4) for y in (-0.3, 0.3)])
    com, frame = np.array([0.05, 0.0, 0.5]), pin.exp3(np.array([0.6, -0.8, 0.0]) * tilt)
    edges = np.tile(generators(frame[:, 2], frame[:, 0], 0.0), (4, 1))
    rays = np.array([cone_generators(frame, 0.0)] * 4)
    assert (robustness(Equilibrium.of(points, rays, com, 1.0, GRAVITY)) > 0) == holds
    assert (checked(np.repeat(points, 4, axis=0), edges, com, GRAVITY) > 0) == holds


def test_equations_that_repeat_and_contradict_each_other() -> None:
    row = np.array([1.0, 1.0, 1.0, 1.0])
    assert max_min_coefficient(np.stack([row, row]), np.array([1.0, 1.0])) == pytest.approx(0.25)
    assert max_min_coefficient(np.stack([row, row]), np.array([1.0, 0.5])) == -np.inf


def test_a_bound_that_is_none() -> None:
    assert max_min_coefficient(np.array([[1.0, -1.0]]), np.array([0.0])) == np.inf
