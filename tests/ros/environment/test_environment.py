"""Snapshots and changes of surfaces and obstacles, without a node."""

from __future__ import annotations

import math
import pickle

import numpy as np
import pytest
from geometry_msgs.msg import Point
from rbprm_msgs.msg import Obstacle as ObstacleMessage
from rbprm_msgs.msg import Surface, SurfaceArray
from shape_msgs.msg import Mesh, MeshTriangle

from rbprm_core.errors import InvalidInput
from rbprm_core.plan_record import SurfaceEntry
from rbprm_core.scene import Classification, make_surface
from rbprm_core.surface_kind import SurfaceKind
from rbprm_ros.conversions.surfaces import update_of_message
from rbprm_ros.environment.snapshot import Obstacle
from rbprm_ros.environment.store import Environment
from rbprm_ros.environment.updates import SurfaceUpdate
from rbprm_ros.settings import Settings, parse_settings

MOST = parse_settings({"max_surfaces": 10})


def tile(identity: str, z: float = 0.0, friction: float = 0.5) -> SurfaceEntry:
    """A unit square."""
    vertices = ((0.0, 0.0, z), (1.0, 0.0, z), (1.0, 1.0, z), (0.0, 1.0, z))
    return SurfaceEntry.model_construct(id=identity, vertices=vertices, holes=(), friction=friction)


@pytest.fixture
def environment() -> Environment:
    """Two tiles."""
    made = Environment()
    made.update(SurfaceUpdate((tile("a"), tile("b", 0.1)), stamp=7), MOST)
    return made


def ids(environment: Environment) -> list[str]:
    return [surface.id for surface in environment.snapshot.surfaces]


def test_nothing_at_first() -> None:
    snapshot = Environment().snapshot
    assert (snapshot.version, snapshot.surfaces) == (0, ())
    with pytest.raises(InvalidInput):
        snapshot.scene()


def test_snapshot_replaces_everything(environment: Environment) -> None:
    assert (environment.snapshot.version, environment.snapshot.stamp) == (1, 7)
    environment.update(SurfaceUpdate((tile("c"),), stamp=9), MOST)
    assert ids(environment) == ["c"]
    assert (environment.snapshot.version, environment.snapshot.stamp) == (2, 9)


def test_diff_removes_modifies_and_adds(environment: Environment) -> None:
    before = environment.snapshot
    update = SurfaceUpdate((tile("b", 0.2), tile("c")), is_diff=True, removed=("a",))
    environment.update(update, MOST)
    assert ids(environment) == ["b", "c"]
    assert environment.snapshot.surfaces[0].polygon.boundary[0, 2] == pytest.approx(0.2)
    assert [entry.id for entry in environment.snapshot.entry.surfaces] == ["b", "c"]
    assert [surface.id for surface in before.surfaces] == ["a", "b"]  # never changed


def test_repeated_surfaces_are_the_same_version_and_objects(environment: Environment) -> None:
    before = environment.snapshot
    after = environment.update(SurfaceUpdate((tile("a"), tile("b", 0.1)), stamp=8), MOST)
    assert (after.version, after.stamp) == (before.version, 8)
    assert all(a is b for a, b in zip(after.surfaces, before.surfaces, strict=True))


def test_diff_before_any_snapshot_adds() -> None:
    environment = Environment()
    environment.update(SurfaceUpdate((tile("a"),), is_diff=True), MOST)
    assert ids(environment) == ["a"]


def test_empty_snapshot_is_an_environment_without_surfaces(environment: Environment) -> None:
    environment.update(SurfaceUpdate(()), MOST)
    assert (environment.snapshot.version, environment.snapshot.surfaces) == (2, ())


@pytest.mark.parametrize(
    ("update", "field"),
    [
        (SurfaceUpdate((tile("c"), tile("c", 0.3))), "surfaces.1.id"),
        (SurfaceUpdate((tile(""),)), "surfaces.0.id"),
        (SurfaceUpdate((tile("c"), tile("d", friction=-1.0))), "surfaces.1.friction"),
        (SurfaceUpdate((tile("c", math.nan),)), "surfaces.0.vertices"),
        (SurfaceUpdate((), removed=("a",)), "removed_ids"),
        (SurfaceUpdate((tile("c"),), is_diff=True, removed=("a", "z")), "removed_ids.1"),
        (SurfaceUpdate(tuple(tile(str(i)) for i in range(11))), "surfaces"),
        (SurfaceUpdate(tuple(tile(str(i)) for i in range(9)), is_diff=True), "surfaces"),
    ],
)
def test_refused_as_a_whole(environment: Environment, update: SurfaceUpdate, field: str) -> None:
    before = environment.snapshot
    with pytest.raises(InvalidInput) as caught:
        environment.update(update, MOST)
    assert caught.value.field == field
    assert environment.snapshot is before
    assert environment.rejection == str(caught.value)
    environment.update(SurfaceUpdate((tile("a"),)), MOST)
    assert environment.rejection == ""


def test_snapshot_crosses_processes(environment: Environment) -> None:
    environment.snapshot.scene().shape  # noqa: B018, makes a collision mesh, which cannot be pickled
    copy = pickle.loads(pickle.dumps(environment.snapshot))
    assert [surface.id for surface in copy.scene().surfaces] == ["a", "b"]


CORNERS = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def mesh(faces: tuple[tuple[int, ...], ...], corners: tuple[object, ...] = CORNERS) -> Mesh:
    vertices = [Point(x=x, y=y, z=z) for x, y, z in corners]  # type: ignore[misc]
    triangles = [MeshTriangle(vertex_indices=np.array(face, dtype=np.uint32)) for face in faces]
    return Mesh(vertices=vertices, triangles=triangles)


WEDGE = mesh(((0, 1, 2), (0, 1, 3)))


def block(identity: str, faces: int = 2) -> Obstacle:
    """A wedge as an obstacle."""
    message = SurfaceArray(obstacles=[ObstacleMessage(id=identity, mesh=WEDGE)])
    (obstacle,) = update_of_message(message, Settings()).obstacles
    return Obstacle(identity, obstacle.triangles[:faces])


def test_obstacles_beside_surfaces(environment: Environment) -> None:
    update = SurfaceUpdate(is_diff=True, obstacles=(block("c"), block("d", 1)))
    snapshot = environment.update(update, MOST)
    assert ids(environment) == ["a", "b"]
    assert [obstacle.id for obstacle in snapshot.obstacles] == ["c", "d"]
    scene = snapshot.scene()
    assert scene.obstacles.shape == (3, 3, 3)
    assert scene.obstacles[0].tolist() == [list(CORNERS[i]) for i in (0, 1, 2)]
    assert len(pickle.loads(pickle.dumps(snapshot)).scene().triangles) == 3 + 4
    environment.update(SurfaceUpdate(is_diff=True, removed=("c", "a")), MOST)
    assert ids(environment) == ["b"]
    assert [obstacle.id for obstacle in environment.snapshot.obstacles] == ["d"]


def test_version_tells_whether_obstacles_changed(environment: Environment) -> None:
    environment.update(SurfaceUpdate(is_diff=True, obstacles=(block("c"),)), MOST)
    version = environment.version
    environment.update(SurfaceUpdate(is_diff=True, obstacles=(block("c"),)), MOST)
    assert environment.version == version
    environment.update(SurfaceUpdate(is_diff=True, obstacles=(block("c", 1),)), MOST)
    assert environment.version == version + 1


def test_obstacles_alone_make_a_scene() -> None:
    environment = Environment()
    assert (
        len(environment.update(SurfaceUpdate(obstacles=(block("c"),)), MOST).scene().triangles) == 2
    )


@pytest.mark.parametrize(
    ("update", "field"),
    [
        (SurfaceUpdate((tile("c"),), obstacles=(block("c"),)), "obstacles.0.id"),
        (SurfaceUpdate(obstacles=(block("c"), block("c"))), "obstacles.1.id"),
        (SurfaceUpdate(obstacles=(block(""),)), "obstacles.0.id"),
        (SurfaceUpdate(is_diff=True, obstacles=(block("a"),)), "obstacles"),
    ],
)
def test_ids_are_unique_over_surfaces_and_obstacles(
    environment: Environment, update: SurfaceUpdate, field: str
) -> None:
    before = environment.snapshot
    with pytest.raises(InvalidInput) as caught:
        environment.update(update, MOST)
    assert caught.value.field == field
    assert environment.snapshot is before


def test_an_id_may_change_from_surface_to_obstacle(environment: Environment) -> None:
    environment.update(SurfaceUpdate(is_diff=True, removed=("a",), obstacles=(block("a"),)), MOST)
    assert ids(environment) == ["b"]
    assert [obstacle.id for obstacle in environment.snapshot.obstacles] == ["a"]


@pytest.mark.parametrize(
    ("wrong", "field"),
    [
        (mesh(()), "triangles"),
        (mesh(((0, 1, 2), (0, 1, 4))), "triangles.1"),
        (mesh(((0, 1, 2), (0, 0, 1))), "triangles.1"),
        (mesh(((0, 1, 2),), ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (2.0, 0.0, 0.0))), "triangles.0"),
        (mesh(((0, 1, 2),), (*CORNERS[:2], (0.0, math.nan, 0.0))), "vertices.2"),
        (mesh(((0, 1, 2),), (*CORNERS[:2], (0.0, 1e6, 0.0))), "vertices.2"),
        (Mesh(triangles=[MeshTriangle()]), "triangles.0"),
    ],
)
def test_meshes_that_are_refused(wrong: Mesh, field: str) -> None:
    obstacles = [ObstacleMessage(id="c", mesh=WEDGE), ObstacleMessage(id="d", mesh=wrong)]
    with pytest.raises(InvalidInput) as caught:
        update_of_message(SurfaceArray(obstacles=obstacles), Settings())
    assert caught.value.field == f"obstacles.1.mesh.{field}"


def test_limits_of_obstacles(environment: Environment) -> None:
    message = SurfaceArray(obstacles=[ObstacleMessage(id=i, mesh=WEDGE) for i in "cd"])
    for name, most in (("max_obstacles", 1), ("max_triangles", 3)):
        with pytest.raises(InvalidInput, match=f"{name} is {most}"):
            update_of_message(message, parse_settings({name: most}))
        environment.update(SurfaceUpdate(obstacles=(block("c"),)), MOST)
        more = SurfaceUpdate(is_diff=True, obstacles=(block("d"),))
        with pytest.raises(InvalidInput, match=f"{name} is {most}"):
            environment.update(more, parse_settings({name: most}))


def test_surfaces_made_together_are_those_made_one_by_one() -> None:
    rng = np.random.default_rng(1)
    entries = [_polygon(f"s{i}", 3 + i % 5, rng) for i in range(60)]
    snapshot = Environment().update(SurfaceUpdate(tuple(entries)), Settings())
    assert [surface.id for surface in snapshot.surfaces] == [entry.id for entry in entries]
    for surface, entry in zip(snapshot.surfaces, entries, strict=True):
        alone = make_surface(entry.id, entry.vertices, entry.friction, entry.holes)
        assert surface.kind is alone.kind
        assert np.array_equal(surface.polygon.boundary, alone.polygon.boundary)
        assert len(surface.polygon.pieces) == len(alone.polygon.pieces)
        for piece, other in zip(surface.polygon.pieces, alone.polygon.pieces, strict=True):
            assert np.array_equal(piece, other)


def _polygon(identity: str, corners: int, rng: np.random.Generator) -> SurfaceEntry:
    """A polygon with a random position and orientation; every third one is concave."""
    angles = np.sort(rng.uniform(0, 1, corners)) + np.arange(corners)
    angles *= 2 * np.pi / corners
    reach = rng.uniform(0.2, 1.0, corners) if rng.integers(3) == 0 else np.ones(corners)
    slope = rng.uniform(-0.3, 0.3, 2)
    x, y = reach * np.cos(angles), reach * np.sin(angles)
    points = np.column_stack([x, y, slope[0] * x + slope[1] * y]) + rng.uniform(-5, 5, 3)
    return SurfaceEntry(id=identity, vertices=tuple(map(tuple, points.tolist())))


def test_classification_that_changes_changes_known_surfaces(environment: Environment) -> None:
    version = environment.version
    strict = Classification(support=0.0)
    snapshot = environment.update(SurfaceUpdate(is_diff=True, classification=strict), MOST)
    assert {surface.kind for surface in snapshot.surfaces} == {SurfaceKind.OTHER}
    assert snapshot.version == version + 1


def test_polygons_are_classified_by_the_parameters() -> None:
    vertices = [Point(x=x, y=y) for x, y in ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0))]
    message = SurfaceArray(surfaces=[Surface(id="a", vertices=vertices, friction=0.5)])
    settings = parse_settings({"classification": {"min_area": 0.6}})
    (surface,) = Environment().update(update_of_message(message, settings), settings).surfaces
    assert surface.kind is SurfaceKind.OTHER


def test_clear_forgets_everything_but_the_count(environment: Environment) -> None:
    version = environment.version
    environment.clear()
    assert (environment.snapshot.surfaces, environment.version) == ((), version + 1)
    environment.update(SurfaceUpdate((tile("a"),), is_diff=True), MOST)
    assert ids(environment) == ["a"]
