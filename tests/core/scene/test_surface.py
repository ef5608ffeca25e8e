"""Surfaces: kind from normal and area, friction."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbprm_core.errors import InvalidInput
from rbprm_core.scene import Classification, make_surface
from rbprm_core.surface_kind import SurfaceKind

SQUARE = np.array([[-0.5, -0.5, 0], [0.5, -0.5, 0], [0.5, 0.5, 0], [-0.5, 0.5, 0]])


@given(st.floats(0, np.pi), st.floats(0, 2 * np.pi))
def test_the_slope_decides_the_kind(slope: float, heading: float) -> None:
    normal = np.array(
        [np.sin(slope) * np.cos(heading), np.sin(slope) * np.sin(heading), np.cos(slope)]
    )
    rule = Classification()
    up = float(np.sum((np.array([0, 0, 1]) - normal) ** 2))
    kind = rule.kind(normal, 1.0)
    if abs(up - rule.support) > 1e-9:  # at the limit either kind is right
        assert (kind is SurfaceKind.SUPPORT) == (up < rule.support)
    if abs(abs(normal[2]) - rule.lean) > 1e-9:
        assert (kind is SurfaceKind.LEAN) == (abs(normal[2]) < rule.lean)


@pytest.mark.parametrize(
    ("turned", "kind"),
    [
        (SQUARE, SurfaceKind.SUPPORT),
        (SQUARE[::-1], SurfaceKind.OTHER),  # a ceiling
        (SQUARE[:, [2, 0, 1]], SurfaceKind.LEAN),
        (SQUARE * 0.04, SurfaceKind.OTHER),  # 16 square centimetres
    ],
)
def test_kinds_of_a_square(turned: Any, kind: SurfaceKind) -> None:
    assert make_surface("a", turned, 0.5).kind is kind


def test_the_classification_is_a_setting() -> None:
    strict = Classification(min_area=2.0)
    assert make_surface("a", SQUARE, 0.5, classification=strict).kind is SurfaceKind.OTHER


def test_no_friction_at_all_is_allowed() -> None:
    assert make_surface("ice", SQUARE, 0.0).friction == 0


@pytest.mark.parametrize(
    "friction", [-0.1, -1e-12, 10.1, float("nan"), float("inf"), "rough", [0.5, 1]]
)
def test_bad_friction_is_refused(friction: Any) -> None:
    with pytest.raises(InvalidInput) as caught:
        make_surface("a", SQUARE, friction, field="environment.surfaces.0")
    assert caught.value.field == "environment.surfaces.0.friction"
    assert caught.value.value is friction


def test_a_bad_polygon_names_the_surface() -> None:
    with pytest.raises(InvalidInput) as caught:
        make_surface("a", SQUARE[:2], 0.5, field="environment.surfaces.7")
    assert caught.value.field == "environment.surfaces.7.vertices"


def test_an_empty_id_is_refused() -> None:
    with pytest.raises(InvalidInput):
        make_surface("", SQUARE, 0.5)
