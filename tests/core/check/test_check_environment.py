"""Triangles of the environment: polygons, distances, points inside and outside."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from shapely.geometry import Point as ShapelyPoint
from shapely.geometry import Polygon

from rbprm_core.check.plan_environment import Environment
from rbprm_core.check.triangle_geometry import by_corner, component_labels, winding_number
from rbprm_core.errors import InvalidInput
from rbprm_core.plan_record import EnvironmentEntry, SurfaceEntry

OUTLINE = [(0, 0), (4, 0), (4, 3), (3, 3), (3, 1), (1, 1), (1, 3), (0, 3)]  # a U
SHIFT = np.array([1.0, 2.0, 3.0])
HOLE = [(1.5, 0.3), (2.5, 0.3), (2.5, 0.7), (1.5, 0.7)]

angles = st.tuples(*[st.floats(-3, 3)] * 3)


def u_shape(turn: Rotation) -> Environment:
    """A U-shaped polygon with a hole, rotated and shifted by (1, 2, 3)."""

    def ring(points: list[tuple[float, float]]) -> list[list[float]]:
        return (turn.apply([(x, y, 0) for x, y in points]) + SHIFT).tolist()

    surface = {"id": "u", "vertices": ring(OUTLINE), "holes": [ring(HOLE)]}
    return Environment(EnvironmentEntry.model_validate({"surfaces": [surface]}))


@given(vector=angles)
@settings(max_examples=20, deadline=None)
def test_polygon_keeps_area_and_side(vector: tuple[float, float, float]) -> None:
    turn = Rotation.from_rotvec(vector)
    environment = u_shape(turn)
    area = trimesh.triangles.area(environment.triangles).sum()
    assert area == pytest.approx(Polygon(OUTLINE, [HOLE]).area, rel=1e-9)
    assert np.allclose(environment.normals, turn.apply([0, 0, 1]), atol=1e-9)


@given(vector=angles, x=st.floats(-1, 5), y=st.floats(-1, 4), z=st.floats(-1, 1))
@settings(max_examples=60, deadline=None)
def test_distance_to_a_polygon(
    vector: tuple[float, float, float], x: float, y: float, z: float
) -> None:
    turn = Rotation.from_rotvec(vector)
    environment = u_shape(turn)
    point = turn.apply([x, y, z]) + SHIFT
    expected = np.hypot(z, Polygon(OUTLINE, [HOLE]).distance(ShapelyPoint(x, y)))
    assert environment.distance(point) == pytest.approx(expected, abs=1e-9)
    facets, distances = environment.distances(point, 0.5)
    assert (len(facets) > 0) == (expected <= 0.5)
    assert (distances <= 0.5).all()


@given(vector=st.tuples(*[st.floats(-2, 2)] * 3))
@settings(max_examples=60, deadline=None)
def test_winding_number_tells_inside(vector: tuple[float, float, float]) -> None:
    ball = trimesh.creation.icosphere(subdivisions=2, radius=1.0)
    radius = np.linalg.norm(vector)
    inner = -trimesh.proximity.signed_distance(ball, [vector])[0] if radius < 1.001 else 1.0
    if abs(inner) < 1e-6:
        return  # on the surface the winding number is 0.5
    number = winding_number(by_corner(np.array(ball.triangles)), np.array(vector))
    assert number == pytest.approx(1.0 if inner < 0 else 0.0, abs=1e-9)


def test_pieces_have_different_labels() -> None:
    first = trimesh.creation.box((1, 1, 1))
    second = first.copy()
    second.apply_translation([3, 0, 0])
    label = component_labels(np.concatenate((first.triangles, second.triangles)))
    assert len(set(label[:12])) == len(set(label[12:])) == 1
    assert label[0] != label[12]


@pytest.mark.parametrize(
    ("vertices", "reason"),
    [
        ([[0, 0, 0], [1, 0, 0]], "3 vertices"),
        ([[0, 0, 0], [1, 0, 0], [2, 0, 0]], "no area"),
        ([[0, 0, 0], [1, 0, 0], [1, 1, 0.1], [0, 1, 0]], "planar"),
        ([[0, 0, 0], [2, 0, 0], [2, 1, 0], [1, -1, 0], [0, 2, 0]], "crosses"),
    ],
)
def test_an_invalid_polygon_is_refused(vertices: list[list[float]], reason: str) -> None:
    surface = SurfaceEntry.model_validate({"id": "s", "vertices": vertices})
    with pytest.raises(InvalidInput, match=reason) as caught:
        Environment(EnvironmentEntry(surfaces=(surface,)))
    assert caught.value.field == "environment.surfaces.0.vertices"
