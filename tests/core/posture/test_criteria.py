"""Criteria: gradients against finite differences, and what they lead to."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from rbprm_core.arrays import Array
from rbprm_core.posture.criteria import (
    Criterion,
    ReferencePath,
    ReferencePosture,
    Robustness,
    WeightedSum,
)

from .conftest import Sequence


def model_gradient(walk: Sequence, criterion: Criterion, q: Array) -> Array:
    return criterion.model(walk.model.kinematics(q), walk.model.coordinates).gradient


def test_a_reference_pulls_towards_itself(rubble_walk: Sequence) -> None:
    start, reference = rubble_walk.states[0].q, rubble_walk.states[1].q
    criterion = ReferencePosture(reference)
    assert np.abs(model_gradient(rubble_walk, criterion, reference)).max() < 1e-12
    coordinates = rubble_walk.model.coordinates
    step = coordinates.difference(start, reference)
    assert model_gradient(rubble_walk, criterion, start) @ step < 0


def test_a_path_pulls_towards_its_nearest_point(rubble_walk: Sequence) -> None:
    model = rubble_walk.robot.model
    first, last = rubble_walk.states[0].q, rubble_walk.states[-1].q

    def path(s: float) -> Array:
        return np.asarray(pin.interpolate(model, first, last, s))

    criterion = ReferencePath(path, samples=11)
    for s in (0.0, 0.3, 1.0):
        assert np.abs(model_gradient(rubble_walk, criterion, path(s))).max() < 1e-9
    between = model_gradient(rubble_walk, criterion, path(0.34))
    nearest = model_gradient(rubble_walk, ReferencePosture(path(0.3)), path(0.34))
    assert between == pytest.approx(nearest)


def test_robustness_has_the_gradient_of_b0(rubble_walk: Sequence) -> None:
    state, coordinates = rubble_walk.states[3], rubble_walk.model.coordinates
    criterion = Robustness(rubble_walk.model.stability, state.contacts)
    step = np.random.default_rng(0).normal(size=coordinates.size)
    values = [
        rubble_walk.model.stability.b0(
            state.contacts, rubble_walk.model.kinematics(coordinates.moved(state.q, h * step)).com
        )
        for h in (1e-6, -1e-6)
    ]
    slope = (values[0] - values[1]) / 2e-6
    assert model_gradient(rubble_walk, criterion, state.q) @ step == pytest.approx(-slope, rel=1e-3)


def test_a_weighted_sum_adds_its_parts(rubble_walk: Sequence) -> None:
    q, coordinates = rubble_walk.states[0].q, rubble_walk.model.coordinates
    one, two = (ReferencePosture(rubble_walk.states[k].q) for k in (2, 5))
    kinematics = rubble_walk.model.kinematics(q)
    total = WeightedSum([(2.0, one), (0.5, two)]).model(kinematics, coordinates)
    parts = [part.model(kinematics, coordinates) for part in (one, two)]
    assert total.gradient == pytest.approx(2.0 * parts[0].gradient + 0.5 * parts[1].gradient)
    assert total.hessian == pytest.approx(2.0 * parts[0].hessian + 0.5 * parts[1].hessian)
