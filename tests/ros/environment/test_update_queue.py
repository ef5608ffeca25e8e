"""Updates are accepted in their order, even where a large mesh among them takes long to search."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

import numpy as np
import pytest
from numpy.typing import NDArray
from rclpy.executors import SingleThreadedExecutor

from rbprm_core.errors import Cancelled, InvalidInput
from rbprm_core.plan_record import SurfaceEntry
from rbprm_ros.environment.store import Environment
from rbprm_ros.environment.update_queue import MAX_TRIANGLES_AT_ONCE, UpdateQueue
from rbprm_ros.environment.updates import MeshUpdate, SurfaceUpdate
from rbprm_ros.settings import Settings

if TYPE_CHECKING:
    from conftest import Site

SQUARE = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 0.0))


class Given:
    """An update queue, its executor, and the versions that it reported."""

    def __init__(self, executor: SingleThreadedExecutor) -> None:
        self.environment, self.executor = Environment(), executor
        self.told: list[int] = []
        self.queue = UpdateQueue(self.environment, Settings, lambda: executor, self._tell)

    @property
    def ids(self) -> set[str]:
        return {surface.id for surface in self.environment.snapshot.surfaces}

    def spin_until(self, done: Callable[[], bool]) -> None:
        for _ in range(1000):
            if done():
                return
            self.executor.spin_once(0.02)
        pytest.fail("not done within 20 s")

    def _tell(self) -> None:
        self.told.append(self.environment.version)


@pytest.fixture
def given(site: Site) -> Iterator[Given]:
    executor = SingleThreadedExecutor(context=site.context)
    yield Given(executor)
    executor.shutdown()


def surface(name: str) -> SurfaceUpdate:
    return SurfaceUpdate((SurfaceEntry(id=name, vertices=SQUARE),), is_diff=True)


def terrain(name: str, cells: int) -> SurfaceUpdate:
    """Rough ground with two triangles a cell, nearly all of which are separate facets."""
    z = np.random.default_rng(0).uniform(0, 0.02, (cells + 1, cells + 1))
    x, y = np.meshgrid(np.arange(cells + 1) * 0.2, np.arange(cells + 1) * 0.2, indexing="ij")
    grid = np.stack([x, y, z], axis=2)
    a, b, c, d = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
    corners: list[NDArray[np.float64]] = [np.stack(t, axis=2) for t in ([a, b, c], [a, c, d])]
    triangles = np.concatenate([part.reshape(-1, 3, 3) for part in corners])
    return SurfaceUpdate(is_diff=True, meshes=(MeshUpdate(name, triangles, 0.5),))


def test_what_is_small_is_there_at_once(given: Given) -> None:
    small = terrain("small", 5)
    assert len(small.meshes[0].triangles) <= MAX_TRIANGLES_AT_ONCE
    assert given.queue.add(small).done()
    assert given.queue.add(surface("after")).done()
    assert "after" in given.ids
    assert len(given.ids) > 40
    assert given.told == [1, 2]


def test_a_large_mesh_holds_up_what_comes_after_it_and_nothing_else(given: Given) -> None:
    large, after = given.queue.add(terrain("large", 30)), given.queue.add(surface("after"))
    ticks = []
    timed = given.executor.create_task(lambda: ticks.append(given.environment.version))
    given.spin_until(timed.done)
    assert ticks == [0]  # other callbacks run meanwhile
    assert not large.done()
    settled = given.executor.create_task(given.queue.settled())
    given.spin_until(settled.done)
    assert large.done()
    assert after.done()
    assert len(given.ids) > 1600
    assert given.told == [1, 2]
    assert given.queue.add(terrain("large", 30)).done()  # it is known already
    assert given.told == [1, 2]


def test_one_that_is_refused_lets_the_next_pass(given: Given) -> None:
    unknown = SurfaceUpdate(is_diff=True, removed=("nothing",), meshes=terrain("l", 10).meshes)
    refused, after = given.queue.add(unknown), given.queue.add(surface("after"))
    given.spin_until(after.done)
    assert isinstance(refused.exception(), InvalidInput)
    assert given.ids == {"after"}


def test_what_was_waiting_when_all_was_forgotten_does_not_come_back(given: Given) -> None:
    large, after = given.queue.add(terrain("large", 20)), given.queue.add(surface("after"))
    given.queue.clear()
    for pending in (large, after):
        assert isinstance(pending.exception(), Cancelled)
    assert given.queue.add(surface("new")).done()
    for _ in range(50):  # until the search has ended
        given.executor.spin_once(0.02)
    assert given.ids == {"new"}


def test_a_fault_is_told_and_lets_the_next_pass(
    given: Given, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Unforeseen errors reach the callers that wait, for large and for small meshes."""

    def fail(*_: object) -> None:
        raise MemoryError("no room")

    for module in ("update_queue", "contents"):
        monkeypatch.setattr(f"rbprm_ros.environment.{module}.search_mesh", fail)
    for cells in (10, 5):
        failed, after = given.queue.add(terrain("mesh", cells)), given.queue.add(surface("s"))
        settled = given.executor.create_task(given.queue.settled())
        given.spin_until(settled.done)
        assert isinstance(failed.exception(), MemoryError)
        assert after.done()
