"""Collision tests of the whole robot agree with those of the planner; features bound the gap."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from rbprm_core.arrays import Array
from rbprm_core.body import State

from .conftest import Sequence, Walks

NAMES = ("rubble", "stairs10")


def moved(walk: Sequence, q: Array, size: float, seed: int) -> Array:
    step = np.random.default_rng(seed).uniform(-size, size, walk.robot.model.nv)
    return np.asarray(pin.integrate(walk.robot.model, q, step))


def planner_finds_collision(walk: Sequence, q: Array, normals: dict[int, Array]) -> bool:
    collision = walk.setting.body.collision
    limbs = range(len(walk.robot.limbs))
    return not (
        collision.root_free(q) and all(collision.limb_free(q, k, normals.get(k)) for k in limbs)
    )


def normals_of(state: State) -> dict[int, Array]:
    return {contact.limb: contact.normal for contact in state.contacts}


@pytest.mark.parametrize("name", NAMES)
def test_the_whole_robot_collides_where_a_part_does(walks: Walks, name: str) -> None:
    walk, found = walks(name), []
    for k, state in enumerate(walk.states):
        for size in (0.0, 0.02, 0.1, 0.3):
            q = moved(walk, state.q, size, k)
            data = walk.model.kinematics(q).data
            hit = walk.model.pairs.collide(data, normals_of(state))
            assert hit == planner_finds_collision(walk, q, normals_of(state))
            found.append(hit)
    assert 0.2 < np.mean(found) < 0.8


@pytest.mark.parametrize("name", NAMES)
def test_a_gap_is_negative_where_bodies_collide(walks: Walks, name: str) -> None:
    walk = walks(name)
    for k, state in enumerate(walk.states):
        data = walk.model.kinematics(moved(walk, state.q, 0.05, k)).data
        near = walk.model.pairs.near(data, normals_of(state))
        hit = walk.model.pairs.collide(data, normals_of(state))
        if abs(near.gaps.min(initial=1.0)) > 1e-6:
            assert hit == (near.gaps.min(initial=1.0) < 0.0)
        assert (near.gaps < 0.0301).all()
        assert np.linalg.norm(near.normals, axis=1) == pytest.approx(np.ones(len(near.gaps)))
