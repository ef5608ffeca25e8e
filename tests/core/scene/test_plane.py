"""Planes: frames, coordinates, and equal results for one ring and for many at once."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbprm_core.arrays import Array
from rbprm_core.scene.plane import plane_axes, plane_from_normal, ring_planes

seeds = st.integers(0, 2**32 - 1)


@given(seeds)
def test_coordinates_and_back(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rotation = pin.exp3(rng.uniform(-3, 3, 3))
    plane = plane_from_normal(rng.uniform(-20, 20, 3), rotation[:, 2])
    frame = np.column_stack([plane.axes, plane.normal])
    assert frame.T @ frame == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(frame) == pytest.approx(1)
    flat = rng.uniform(size=(5, 2))
    points = plane.lift(flat)
    assert plane.flatten(points) == pytest.approx(flat, abs=1e-9)
    assert (points - plane.origin) @ plane.normal == pytest.approx(np.zeros(5), abs=1e-9)


@pytest.mark.parametrize("normal", [*np.eye(3), *-np.eye(3)], ids=str)
def test_axes_along_every_axis(normal: Array) -> None:
    plane = plane_from_normal(np.zeros(3), normal)
    assert np.cross(*plane.axes.T) == pytest.approx(normal)


@given(seeds, st.integers(3, 12))
def test_many_at_once_are_as_one_by_one(seed: int, size: int) -> None:
    """Bitwise, since a scene must not depend on how its surfaces are batched into messages."""
    rings = np.random.default_rng(seed).uniform(-20, 20, (7, size, 3))
    together = ring_planes(rings)
    axes = plane_axes(together[1])
    for k in range(len(rings)):
        alone = ring_planes(rings[k : k + 1])
        for all_of, one in zip(together, alone, strict=True):
            assert np.array_equal(all_of[k], one[0])
        assert np.array_equal(axes[k], plane_axes(alone[1])[0])


def test_a_ring_without_area_says_so() -> None:
    _, normals, areas = ring_planes(np.array([[[0.0, 0, 0], [1, 0, 0], [2, 0, 0]]]))
    assert areas == pytest.approx(0)
    assert np.isfinite(normals).all()
