"""Contacts without weight, and under gravity that does not point down."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from rbprm_core.body.state import State
from rbprm_core.contacts.along_guide import ContactGenerator, start_state
from rbprm_core.contacts.along_guide.footholds import _level_axes, _over_support
from rbprm_core.contacts.along_guide.options import GeneratorOptions
from rbprm_core.robot.data import RobotData
from rbprm_core.scenario import Scenario, load_scenario
from rbprm_core.scene import Scene, make_surface
from rbprm_core.statics import grip_robustness

Array = NDArray[np.float64]
NO_GRAVITY = np.zeros(3)
GRAVITY = np.array([0.0, 0.0, -9.81])
seeds = st.integers(0, 2**32 - 1)


@pytest.fixture(scope="module")
def pen() -> Scenario:
    return load_scenario("pen")


def first_state(data: RobotData, scenario: Scenario, generator: ContactGenerator) -> State:
    request = scenario.request_for(data.robot)
    names = [limb.name for limb in data.robot.limbs]
    root = np.concatenate([request.start.position, request.start.orientation])
    return start_state(generator, root, [names.index(name) for name in request.start_limbs])


def generator_on(
    data: RobotData, scenario: Scenario, threshold: float = 0.0, grip_force: float = 10.0
) -> ContactGenerator:
    options = scenario.options.generator
    return ContactGenerator(
        data, scenario.scene(), NO_GRAVITY, threshold, options, None, grip_force
    )


def test_a_state_without_weight_is_in_force_closure(allegro_data: RobotData, pen: Scenario) -> None:
    generator = generator_on(allegro_data, pen)
    state = first_state(allegro_data, pen, generator)
    points = np.concatenate([c.points for c in state.contacts])
    rays = np.concatenate([c.generators for c in state.contacts])
    assert len(points) == 3
    assert state.robustness == pytest.approx(grip_robustness(points, rays, 10.0))
    assert state.robustness > 0
    assert not generator.body.robustness(state.q, state.contacts[:2]) > 0
    assert generator.body.robustness(state.q, []) == -np.inf


def test_a_threshold_without_weight_is_held(allegro_data: RobotData, pen: Scenario) -> None:
    state = first_state(allegro_data, pen, generator_on(allegro_data, pen, 0.4))
    assert state.robustness >= 0.4


def test_the_grip_scales_b0_and_chooses_the_same_contacts(
    allegro_data: RobotData, pen: Scenario
) -> None:
    once = first_state(allegro_data, pen, generator_on(allegro_data, pen, 0.3, 10.0))
    thrice = first_state(allegro_data, pen, generator_on(allegro_data, pen, 0.9, 30.0))
    assert thrice.robustness == pytest.approx(3 * once.robustness)
    assert np.array_equal(thrice.q, once.q)


@settings(max_examples=50)
@given(seeds, seeds)
def test_steady_footholds_turn_with_gravity(seed: int, turn: int) -> None:
    rng = np.random.default_rng(seed)
    points, standing = rng.normal(size=(20, 1, 3)), rng.normal(size=(3, 3))
    com = 0.5 * rng.normal(size=(20, 3))
    rotation = pin.exp3(np.random.default_rng(turn).uniform(-2, 2, 3))
    level, turned = _level_axes(GRAVITY), _level_axes(rotation @ GRAVITY)
    parts = (points, standing, com)
    plain = _over_support(*(part[..., :2] for part in parts))
    assert np.array_equal(_over_support(*(part @ level for part in parts)), plain)
    moved = (part @ rotation.T @ turned for part in parts)
    assert np.array_equal(_over_support(*moved), plain)


def test_without_gravity_nothing_is_over_anything() -> None:
    none = _level_axes(NO_GRAVITY)
    points = np.ones((5, 1, 3))
    assert _over_support(points @ none, np.zeros((0, 3)) @ none, np.zeros((5, 3)) @ none).all()


def test_a_leaning_world_is_walked_on_like_a_level_one(
    hyq_data: RobotData, flat_scene: Scene
) -> None:
    """Turn ground, root and gravity together: the same contacts, turned."""
    rotation = pin.exp3(np.array([0.0, 0.25, 0.0]))
    ground = flat_scene.surfaces[0].polygon.boundary @ rotation.T
    leaning = Scene([make_surface("ground", ground, 0.5)])
    root = np.array([0.0, 0.0, 0.6, 0.0, 0.0, 0.0, 1.0])
    turned = np.concatenate([rotation @ root[:3], pin.Quaternion(rotation).coeffs()])
    options = GeneratorOptions()
    level = start_state(
        ContactGenerator(hyq_data, flat_scene, GRAVITY, 10.0, options), root, range(4)
    )
    lean = start_state(
        ContactGenerator(hyq_data, leaning, rotation @ GRAVITY, 10.0, options), turned, range(4)
    )
    assert lean.robustness == pytest.approx(level.robustness, rel=1e-6)
    for a, b in zip(level.contacts, lean.contacts, strict=True):
        assert b.position == pytest.approx(rotation @ a.position, abs=1e-6)
