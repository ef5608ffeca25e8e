"""Snapshots and changes of the surfaces, without ROS."""

from __future__ import annotations

import math
import pickle

import pytest

from rbprm_core.errors import InvalidInput
from rbprm_core.plan import SurfaceEntry
from rbprm_ros.environment import Environment, SurfaceUpdate

MOST = 10


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
    environment.snapshot.scene().shape  # noqa: B018, a collision mesh, which could not cross
    copy = pickle.loads(pickle.dumps(environment.snapshot))
    assert [surface.id for surface in copy.scene().surfaces] == ["a", "b"]
