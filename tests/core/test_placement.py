"""Placements in SE(3)."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbprm_core.errors import InvalidInput
from rbprm_core.placement import Placement


@given(st.integers(0, 2**32 - 1))
def test_to_a_transform_and_back(seed: int) -> None:
    rng = np.random.default_rng(seed)
    transform = pin.SE3(pin.exp3(rng.uniform(-2, 2, 3)), rng.uniform(-9, 9, 3))
    placement = Placement.of(transform)
    assert np.linalg.norm(placement.orientation) == pytest.approx(1)
    assert placement.transform.homogeneous == pytest.approx(transform.homogeneous)
    again = Placement.parse(placement.position, placement.orientation)
    assert again.orientation == pytest.approx(placement.orientation)


def test_the_quaternion_is_x_y_z_w() -> None:
    turned = Placement.parse((0, 0, 0), (0, 0, np.sqrt(0.5), np.sqrt(0.5))).transform
    assert turned.rotation @ [1, 0, 0] == pytest.approx([0, 1, 0])
    assert Placement.parse((1, 2, 3)).transform.rotation == pytest.approx(np.eye(3))


@given(st.integers(0, 2**32 - 1))
def test_single_precision_is_precise_enough(seed: int) -> None:
    quaternion = np.random.default_rng(seed).normal(size=4)
    quaternion /= np.linalg.norm(quaternion)
    found = Placement.parse((0, 0, 0), quaternion.astype(np.float32)).orientation
    assert np.linalg.norm(found) == pytest.approx(1, abs=1e-12)
    assert found == pytest.approx(quaternion, abs=1e-6)


@pytest.mark.parametrize(
    ("orientation", "reason"),
    [
        ((0, 0, 0, 0), "norm is 0"),
        ((0, 0, 0, 2), "norm is 2"),
        ((0, 0, 0, 0.99), "unit quaternion"),
        ((0, 0, 0, float("nan")), "finite"),
        ((0, 0, float("inf"), 1), "finite"),
        ((0, 0, 1), "shape"),
        ("up", "numbers"),
        (None, "shape"),
    ],
)
def test_a_bad_orientation(orientation: Any, reason: str) -> None:
    with pytest.raises(InvalidInput, match=reason) as caught:
        Placement.parse((0, 0, 0), orientation, "request.start")
    assert caught.value.field == "request.start.orientation"
    assert caught.value.value is orientation


@pytest.mark.parametrize(
    "position", [(0, 0), (0, 0, float("nan")), (float("-inf"), 0, 0), "here", [[0, 0, 0]]]
)
def test_a_bad_position(position: Any) -> None:
    with pytest.raises(InvalidInput) as caught:
        Placement.parse(position, field="request.goal")
    assert caught.value.field == "request.goal.position"
