"""Meshes: reading files, merging coplanar facets, stable ids."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from rbprm_core.arrays import Array
from rbprm_core.errors import InvalidInput
from rbprm_core.scene import (
    Classification,
    MeshSource,
    Scene,
    Surface,
    read_triangles,
    surfaces_from_mesh,
)
from rbprm_core.surface_kind import SurfaceKind

RUBBLE = "hpp_environments/meshes/multicontact/darpareduced.stl"
RULE = Classification()
AHEAD = np.array([1.0, 0, 0])


def source(file: Path | str) -> MeshSource:
    return MeshSource(str(file), np.zeros(3), np.eye(3))


def surfaces(triangles: Array) -> list[Surface]:
    return surfaces_from_mesh(triangles, 0.5, RULE)


def ids(triangles: Array) -> set[str]:
    return {surface.id for surface in surfaces(triangles)}


def placed_box(seed: int) -> Array:
    """Triangles of a box with random size and pose."""
    rng = np.random.default_rng(seed)
    mesh = trimesh.creation.box(extents=rng.uniform(0.1, 2, 3))
    rotation = pin.exp3(rng.uniform(-np.pi, np.pi) * np.array([0.6, 0, 0.8]))
    return np.asarray(mesh.triangles @ rotation.T + rng.uniform(-5, 5, 3))


def subdivided(triangles: Array) -> Array:
    """Triangles of a mesh with each triangle cut into four."""
    a, b, c = triangles.transpose(1, 0, 2)
    ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
    parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return np.concatenate([np.stack(part, axis=1) for part in parts])


def plate(low: float, high: float, height: float = 0.0) -> Array:
    """Two triangles of a horizontal square, seen from above."""
    a, b, c, d = (np.array([x, y, height]) for x, y in corners(low, high))
    return np.array([[a, b, c], [a, c, d]])


def corners(low: float, high: float) -> list[tuple[float, float]]:
    return [(low, low), (high, low), (high, high), (low, high)]


seeds = st.integers(0, 2**32 - 1)


@settings(max_examples=25)
@given(seeds, seeds)
def test_ids_do_not_depend_on_the_order_of_facets(seed: int, shuffle: int) -> None:
    triangles = np.concatenate([placed_box(seed), placed_box(seed + 1)])
    rng = np.random.default_rng(shuffle)
    mixed = triangles[rng.permutation(len(triangles))]
    mixed = np.array([np.roll(t, rng.integers(3), axis=0) for t in mixed])
    assert ids(mixed) == ids(triangles)
    assert len(ids(triangles)) == 12


@settings(max_examples=25)
@given(seeds, seeds)
def test_an_edit_renames_nothing_elsewhere(seed: int, other: int) -> None:
    kept, far = placed_box(seed), 20 * AHEAD
    before = ids(np.concatenate([kept, placed_box(other) + far]))
    after = ids(np.concatenate([placed_box(other + 1) + far, kept]))
    assert ids(kept) <= before & after
    assert before != after


def test_ids_of_the_rubble_survive_shuffling_and_an_added_box() -> None:
    triangles = read_triangles(source(RUBBLE))
    before = ids(triangles)
    order = np.random.default_rng(3).permutation(len(triangles))
    assert ids(triangles[order]) == before
    assert ids(np.concatenate([placed_box(1) + 30 * AHEAD, triangles])) > before


@settings(max_examples=20)
@given(seeds)
def test_a_cut_up_box_has_six_faces(seed: int) -> None:
    box = placed_box(seed)
    found = surfaces(subdivided(subdivided(box)))
    areas = np.linalg.norm(np.cross(box[:, 1] - box[:, 0], box[:, 2] - box[:, 0]), axis=1) / 2
    assert len(found) == 6
    assert sum(surface.polygon.area for surface in found) == pytest.approx(areas.sum(), rel=1e-4)
    middle = box.reshape(-1, 3).mean(axis=0)
    for surface in found:
        assert (surface.polygon.boundary.mean(axis=0) - middle) @ surface.normal > 0
        assert len(surface.polygon.boundary) == 4


def test_coplanar_neighbours_merge_and_others_do_not() -> None:
    apart = np.concatenate([plate(0, 1), plate(2, 3), plate(0, 1, 0.5)])
    assert len(surfaces(apart)) == 3
    joined = np.concatenate([plate(0, 1), plate(0, 1) + AHEAD])
    (merged,) = surfaces(joined)
    assert merged.polygon.area == pytest.approx(2, rel=1e-5)


def test_a_region_may_have_a_hole() -> None:
    ring = np.concatenate(
        [plate(0, 1) + np.array([x, y, 0]) for x in range(3) for y in range(3) if (x, y) != (1, 1)]
    )
    (found,) = surfaces(ring)
    assert len(found.polygon.holes) == 1
    assert found.polygon.area == pytest.approx(8, rel=1e-5)


def test_the_winding_counts_and_not_the_files_normals(tmp_path: Path) -> None:
    mesh = trimesh.creation.box()
    data = bytearray(mesh.export(file_type="stl"))
    for k in range(len(mesh.faces)):  # each record: normal, three corners, two bytes
        data[84 + 50 * k : 96 + 50 * k] = np.array([0, 0, -1], dtype="<f4").tobytes()
    file = tmp_path / "box.stl"
    file.write_bytes(bytes(data))
    kinds = sorted(surface.kind for surface in surfaces(read_triangles(source(file))))
    assert kinds == [SurfaceKind.LEAN] * 4 + [SurfaceKind.OTHER] + [SurfaceKind.SUPPORT]


def test_facets_without_area_and_facets_given_twice_do_not_matter() -> None:
    flat = plate(0, 1)
    sliver = np.array([[[0, 0, 0], [1, 0, 0], [0.5, 0, 0]]])
    point = np.zeros((1, 3, 3))
    assert ids(np.concatenate([flat, sliver, point])) == ids(flat)
    assert len(surfaces(np.concatenate([flat[:1], flat[:1]]))) == 1


@pytest.mark.parametrize("count", [1, 2])
def test_both_sides_of_a_thin_plate_are_surfaces(count: int) -> None:
    top = plate(0, 1)[:count]
    found = surfaces(np.concatenate([top, top[:, ::-1]]))
    assert sorted(surface.normal[2] for surface in found) == pytest.approx([-1, 1])


def test_friction_is_the_meshs() -> None:
    assert {s.friction for s in surfaces_from_mesh(plate(0, 1), 0.7, RULE)} == {0.7}


def test_a_mesh_stands_where_it_is_put(tmp_path: Path) -> None:
    file = tmp_path / "box.stl"
    trimesh.creation.box().export(file)
    turned = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]])
    here = read_triangles(source(file))
    there = read_triangles(MeshSource(str(file), np.array([1.0, 2, 3]), turned))
    assert there == pytest.approx(here @ turned.T + [1, 2, 3])


@pytest.mark.parametrize("kind", ["stl", "stl_ascii", "obj", "ply", "off", "glb"])
def test_formats(tmp_path: Path, kind: str) -> None:
    file = tmp_path / f"box.{kind.removesuffix('_ascii')}"
    trimesh.creation.box().export(file, file_type=kind)
    assert len(read_triangles(source(file))) == 12


def test_the_rubble_has_ground_to_stand_on() -> None:
    scene = Scene(surfaces(read_triangles(source(RUBBLE))))
    kinds = {surface.kind for surface in scene.surfaces}
    assert {SurfaceKind.SUPPORT, SurfaceKind.LEAN} <= kinds


def cut(share: float) -> Callable[[bytes], bytes]:
    return lambda data: data[: int(share * len(data))]


@pytest.mark.parametrize(
    ("kind", "spoil"),
    [
        ("stl", cut(0)),
        ("stl", cut(0.05)),
        ("stl", cut(0.5)),
        ("stl", cut(0.99)),
        ("stl_ascii", cut(0.5)),
        ("stl_ascii", cut(0.98)),
        ("ply", cut(0.5)),
        ("glb", cut(0.5)),
        ("obj", cut(0)),
        ("stl", lambda data: b"not a mesh at all, whatever its name says\n" * 20),
    ],
)
def test_a_spoilt_mesh_is_refused(
    tmp_path: Path, kind: str, spoil: Callable[[bytes], bytes]
) -> None:
    file = tmp_path / f"box.{kind.removesuffix('_ascii')}"
    data = trimesh.creation.box().export(file_type=kind)
    file.write_bytes(spoil(data.encode() if isinstance(data, str) else data))
    with pytest.raises(InvalidInput) as caught:
        read_triangles(source(file), "environment.meshes.0")
    assert caught.value.field == "environment.meshes.0.file"
    assert caught.value.value == str(file)


def test_a_truncated_off_file_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "box.off"
    text = trimesh.creation.box().export(file_type="off")
    file.write_text(text[: int(0.9 * len(text))])
    with pytest.raises(InvalidInput):
        read_triangles(source(file))


def test_an_absent_mesh_is_refused() -> None:
    with pytest.raises(InvalidInput, match="no such file") as caught:
        read_triangles(source("no/such.stl"), "environment.meshes.2")
    assert caught.value.field == "environment.meshes.2.file"


def test_an_unknown_format_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "box.mesh3000"
    file.write_text("?")
    with pytest.raises(InvalidInput, match="cannot be read"):
        read_triangles(source(file))


@pytest.mark.filterwarnings("ignore:invalid value:RuntimeWarning")  # raised inside the mesh library
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_coordinates_that_are_not_finite_are_refused(tmp_path: Path, value: float) -> None:
    mesh = trimesh.creation.box()
    data = bytearray(mesh.export(file_type="stl"))
    data[96:100] = np.array([value], dtype="<f4").tobytes()
    file = tmp_path / "box.stl"
    file.write_bytes(bytes(data))
    with pytest.raises(InvalidInput, match="finite"):
        read_triangles(source(file))


def test_a_sheet_that_bends_gently_is_no_plane() -> None:
    edges = np.linspace(-1.2, 1.2, 60)
    heights = 20 - np.sqrt(20**2 - edges**2)
    strips = []
    for x0, x1, z0, z1 in zip(edges, edges[1:], heights, heights[1:], strict=False):
        a, b, c, d = [x0, -1, z0], [x1, -1, z1], [x1, 1, z1], [x0, 1, z0]
        strips += [[a, b, c], [a, c, d]]
    for surface in surfaces(np.array(strips)):
        plane = surface.polygon.plane
        nearest = np.abs((np.array(strips).reshape(-1, 3) - plane.origin) @ plane.normal).min()
        assert nearest < 1e-3
        assert np.ptp(surface.polygon.boundary[:, 2]) < 0.01
