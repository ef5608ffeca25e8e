"""The linearised friction cone: unit generators on the cone, symmetric about the normal."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbprm_core.statics import cone_generators
from rbprm_core.statics.cone import MIN_FRICTION


@given(st.integers(0, 2**32 - 1), st.floats(0, 3))
def test_generators_are_unit_rays_on_the_cone(seed: int, friction: float) -> None:
    rotation = pin.exp3(np.random.default_rng(seed).uniform(-2, 2, 3))
    rays = cone_generators(rotation, friction)
    assert rays.shape == (4, 3)
    assert np.linalg.norm(rays, axis=1) == pytest.approx(np.ones(4))
    along = rays @ rotation[:, 2]
    across = np.linalg.norm(rays - along[:, None] * rotation[:, 2], axis=1)
    assert across == pytest.approx(max(friction, MIN_FRICTION) * along, abs=1e-12)
    assert (along > 0).all()
    middle = rays.sum(axis=0)
    assert middle / np.linalg.norm(middle) == pytest.approx(rotation[:, 2])


def test_the_rays_of_the_paper() -> None:
    rays = cone_generators(np.eye(3), 0.5) * np.sqrt(1.25)
    assert rays == pytest.approx(np.array([[0.5, 0, 1], [-0.5, 0, 1], [0, 0.5, 1], [0, -0.5, 1]]))


def test_without_friction_every_ray_is_the_normal_but_for_a_tenth_of_a_millimetre_in_a_metre() -> (
    None
):
    normals = np.tile([0, 0, 1], (4, 1))
    assert cone_generators(np.eye(3), 0.0) == pytest.approx(normals, abs=1.001e-4)
