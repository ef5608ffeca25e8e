"""Scenes: edits, convex pieces, coal meshes, and points inside closed parts."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rbprm_core.errors import InvalidInput
from rbprm_core.scene import Scene, Surface, make_surface
from rbprm_core.scene.scene import MAX_SHAPES, MIN_SHAPE_TRIANGLES
from rbprm_core.surface_kind import SurfaceKind

Box = Callable[..., list[Surface]]
L_SHAPE = np.array([[0, 0, 0], [2, 0, 0], [2, 1, 0], [1, 1, 0], [1, 2, 0], [0, 2, 0.0]])
SUPPORT = (SurfaceKind.SUPPORT,)


def tile(name: str, height: float = 0.0) -> Surface:
    return make_surface(name, [[0, 0, height], [1, 0, height], [1, 1, height]], 0.5)


def moved(faces: list[Surface], place: pin.SE3) -> list[Surface]:
    return [
        make_surface(
            face.id, face.polygon.boundary @ place.rotation.T + place.translation, face.friction
        )
        for face in faces
    ]


def test_an_empty_scene_is_refused() -> None:
    with pytest.raises(InvalidInput, match="neither"):
        Scene([])


def test_obstacles_alone_are_a_scene() -> None:
    scene = Scene([], np.zeros((1, 3, 3)))
    assert len(scene.triangles) == 1
    assert scene.surfaces_shape(SUPPORT) is None


def test_two_surfaces_of_one_id_are_refused() -> None:
    with pytest.raises(InvalidInput, match="this id") as caught:
        Scene([tile("a"), tile("b"), tile("a", 1.0)])
    assert caught.value.value == "a"


def test_an_edit_adds_modifies_and_removes_in_a_new_scene() -> None:
    scene = Scene([tile("a"), tile("b"), tile("c")])
    edited = scene.edited(changed=[tile("b", 0.3), tile("d")], removed=["a"])
    assert set(edited.index) == {"b", "c", "d"}
    assert edited.surfaces[edited.index["b"]].polygon.plane.origin[2] == pytest.approx(0.3)
    assert edited.surfaces[edited.index["c"]] is scene.surfaces[scene.index["c"]]
    assert set(scene.index) == {"a", "b", "c"}
    assert scene.surfaces[scene.index["b"]].polygon.plane.origin[2] == 0


def test_what_is_not_there_cannot_be_removed() -> None:
    with pytest.raises(InvalidInput, match="no surface") as caught:
        Scene([tile("a")]).edited(removed=["b"])
    assert (caught.value.field, caught.value.value) == ("removed", "b")


def test_the_last_surface_cannot_be_removed() -> None:
    with pytest.raises(InvalidInput, match="neither"):
        Scene([tile("a")]).edited(removed=["a"])


@settings(max_examples=30)
@given(st.integers(0, 2**32 - 1))
def test_pieces_hold_the_points_of_their_surface(seed: int) -> None:
    rng = np.random.default_rng(seed)
    place = pin.SE3(pin.exp3(rng.uniform(-0.4, 0.4, 3)), rng.uniform(-3, 3, 3))
    surface = make_surface("l", L_SHAPE @ place.rotation.T + place.translation, 0.4)
    pieces = Scene([surface]).pieces(SUPPORT)
    flat = rng.uniform(-0.5, 2.5, (300, 2))
    border = np.abs(flat[:, :, None] - [0, 1, 2]).min(axis=(1, 2)) < 1e-6
    x, y = flat.T
    wanted = (flat > 0).all(axis=1) & (flat < 2).all(axis=1) & ~((x > 1) & (y > 1))
    points = np.column_stack([flat, np.zeros(300)]) @ place.rotation.T + place.translation
    heights = points @ pieces.normals.T - pieces.offsets
    assert np.abs(heights).max() < 1e-9
    inside = (np.einsum("pek,nk->npe", pieces.edge_normals, points) >= pieces.edge_offsets).all(
        axis=2
    )
    assert (inside.any(axis=1) == wanted)[~border].all()
    boxed = ((points[:, None] >= pieces.low - 1e-9) & (points[:, None] <= pieces.high + 1e-9)).all(
        axis=2
    )
    assert (boxed | ~inside).all()


def test_pieces_are_of_the_kinds_asked_for(make_box: Box) -> None:
    scene = Scene(make_box("b", np.zeros(3), np.ones(3)))
    assert len(scene.pieces(SUPPORT).surface) == 1
    assert len(scene.pieces((SurfaceKind.LEAN,)).surface) == 4
    assert len(scene.pieces((SurfaceKind.SUPPORT, SurfaceKind.LEAN)).surface) == 5
    only_walls = Scene([f for f in scene.surfaces if f.kind is SurfaceKind.LEAN])
    assert len(only_walls.pieces(SUPPORT).surface) == 0
    assert only_walls.surfaces_shape(SUPPORT) is None


def test_everything_can_be_hit(make_box: Box) -> None:
    low, high = np.zeros(3), np.array([1.0, 2, 3])
    obstacle = np.array([[[5, 0, 0], [6, 0, 0], [5, 1, 0.0]]])
    triangles = Scene(make_box("b", low, high), obstacle).triangles
    sides = triangles[:, 1:] - triangles[:, :1]
    areas = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1) / 2
    assert areas.sum() == pytest.approx(2 * (2 + 3 + 6) + 0.5)


@settings(max_examples=60)
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, 700), same=st.booleans())
def test_every_triangle_is_in_exactly_one_shape(seed: int, count: int, same: bool) -> None:
    rng = np.random.default_rng(seed)
    triangles = rng.normal(size=(count, 3, 3))
    if same:
        triangles[:] = triangles[0]  # all in one place
    shapes = Scene([], triangles).shapes
    parts = [np.asarray(shape.vertices()).reshape(-1, 3, 3) for shape in shapes]
    limit = max(MIN_SHAPE_TRIANGLES, -(-count // MAX_SHAPES))
    assert max(map(len, parts)) <= limit
    assert len(parts) < 2 * MAX_SHAPES
    found, wanted = np.concatenate(parts).reshape(-1, 9), triangles.reshape(-1, 9)
    assert np.array_equal(found[np.lexsort(found.T)], wanted[np.lexsort(wanted.T)])


def test_a_shape_is_of_triangles_that_are_near_to_each_other() -> None:
    corner = 0.1 * np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.0]])
    places = np.stack(np.meshgrid(np.arange(16.0), np.arange(16.0), [0.0]), axis=-1).reshape(-1, 3)
    order = np.random.default_rng(0).permutation(len(places))
    shapes = Scene([], places[order][:, None] + corner).shapes
    sizes = [np.ptp(np.asarray(shape.vertices()), axis=0).max() for shape in shapes]
    assert len(shapes) == MAX_SHAPES
    assert max(sizes) < 4  # of 16


@settings(max_examples=40)
@given(seed=st.integers(0, 2**32 - 1))
def test_inside_a_closed_box_and_nowhere_else(make_box: Box, seed: int) -> None:
    rng = np.random.default_rng(seed)
    half = rng.uniform(0.2, 1.0, (2, 3))
    places = [pin.SE3.Identity() for _ in range(2)]
    for k, place in enumerate(places):
        place.translation = rng.uniform(-1, 1, 3) + 6 * k * np.eye(3)[0]
        place.rotation = pin.exp3(rng.uniform(-2, 2, 3))
    faces = [
        face
        for k, place in enumerate(places)
        for face in moved(make_box(f"b{k}", -half[k], half[k]), place)
    ]
    ground = make_surface("ground", [[-9, -9, -4], [15, -9, -4], [15, 9, -4], [-9, 9, -4]], 0.5)
    scene = Scene([*faces, ground])
    for point in rng.uniform([-2.5, -2.5, -3.9], [8, 2.5, 3], (20, 3)):
        depths = [
            float((np.abs(place.actInv(point)) - half[k]).max()) for k, place in enumerate(places)
        ]
        if min(map(abs, depths)) > 1e-3:
            assert scene.encloses(point) == (min(depths) < 0)


def test_an_open_box_holds_its_middle_but_not_what_is_above(make_box: Box) -> None:
    faces = make_box("b", -np.ones(3), np.ones(3))
    scene = Scene([face for face in faces if face.normal[2] > -0.5])  # open below
    assert scene.encloses(np.zeros(3))
    assert not scene.encloses(np.array([0, 0, 1.5]))


@pytest.mark.parametrize("height", [1e-3, -1e-3])
def test_nothing_is_inside_the_open_ground(height: float) -> None:
    wide = make_surface("g", [[-9, -9, 0], [9, -9, 0], [9, 9, 0], [-9, 9, 0]], 0.5)
    assert not Scene([wide]).encloses(np.array([0, 0, height]))


def test_the_inside_of_a_room_is_free(make_box: Box) -> None:
    walls = [
        make_surface(face.id, face.polygon.boundary[::-1], 0.5)
        for face in make_box("room", np.zeros(3), 4 * np.ones(3))
    ]
    assert not Scene(walls).encloses(2 * np.ones(3))


def test_boxes_of_the_surfaces() -> None:
    scene = Scene([make_surface("l", L_SHAPE, 0.5), tile("t", 3.0)])
    low, high = scene.boxes
    assert np.array_equal(low, [[0, 0, 0], [0, 0, 3]])
    assert np.array_equal(high, [[2, 2, 0], [1, 1, 3]])
    assert all(len(corner) == 0 for corner in Scene([], np.zeros((1, 3, 3))).boxes)
