"""Updates of the environment, taken in one after the other; large meshes are searched beside."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future as WorkFuture

from rclpy.executors import Executor
from rclpy.task import Future

from rbprm_core.errors import Cancelled
from rbprm_core.scene import Classification
from rbprm_ros.environment.store import (
    Environment,
    FoundSurfaces,
    Limits,
    MeshUpdate,
    SurfaceUpdate,
    search,
)
from rbprm_ros.rclpy_utils.awaiting import outcome_of

SMALL = 100
"""Triangles that are searched at once, in at most 30 ms: most markers are boxes and the like. More
of them would keep the executor's thread from cancels, answers and statuses."""


class Intake:
    """Takes updates in, in their order.

    Everything runs in the executor's thread but the search of meshes, which has one of its own.

    Args:
        limits: gives those of now. executor: gives the one that runs the callbacks.
        on_change: called after an update that changed something.
    """

    def __init__(
        self,
        environment: Environment,
        limits: Callable[[], Limits],
        executor: Callable[[], Executor],
        on_change: Callable[[], None],
    ) -> None:
        self._environment, self._limits, self._executor = environment, limits, executor
        self._on_change = on_change
        self._waiting: deque[tuple[SurfaceUpdate, Future]] = deque()
        self._searching: Future | None = None  # of the update whose meshes are searched
        self._newest: Future | None = None

    def take(self, update: SurfaceUpdate) -> Future:
        """Take an update in after those before it.

        Returns:
            Done when it is in. It raises `InvalidInput`, which names the field, where the update is
            refused, and `Cancelled` where everything was forgotten before its turn.
        """
        self._newest = Future()
        self._waiting.append((update, self._newest))
        self._go_on()
        return self._newest

    async def settled(self) -> None:
        """Wait until all that was given has been taken in or refused."""
        newest = self._newest
        if newest is not None and not newest.done():
            done: Future = Future()
            newest.add_done_callback(lambda _: done.set_result(None))
            await done

    def clear(self) -> None:
        """Forget the environment, and what waits to be taken in."""
        self._environment.clear()
        pending = [done for _, done in self._waiting]
        if self._searching is not None:
            pending.append(self._searching)
        self._waiting.clear()
        self._searching = None
        for done in pending:
            done.set_exception(Cancelled("waiting"))

    def _go_on(self) -> None:
        """Take in what waits, up to what has to be searched first."""
        while self._waiting and self._searching is None:
            update, done = self._waiting.popleft()
            meshes = self._environment.unsearched(update)
            if sum(len(mesh.triangles) for mesh in meshes) <= SMALL:
                self._apply(update, (), done)
            else:
                self._searching = done
                self._executor().create_task(self._search(update, meshes, done))

    async def _search(
        self, update: SurfaceUpdate, meshes: tuple[MeshUpdate, ...], done: Future
    ) -> None:
        found: tuple[FoundSurfaces, ...] | Exception
        try:
            found = await outcome_of(_searched(meshes, update.classification), self._executor())
        except Exception as error:
            found = error
        if self._searching is not done:  # it was forgotten
            return
        self._searching = None
        if isinstance(found, Exception):
            self._refuse(done, found)
        else:
            self._apply(update, found, done)
        self._go_on()

    def _apply(self, update: SurfaceUpdate, found: tuple[FoundSurfaces, ...], done: Future) -> None:
        before = self._environment.version
        try:
            self._environment.update(update, self._limits(), found)
        except Exception as error:
            self._refuse(done, error)
            return
        if self._environment.version != before:
            self._on_change()
        done.set_result(None)
        self._executor().wake()  # who awaits it goes on when the executor looks, not by itself

    def _refuse(self, done: Future, error: Exception) -> None:
        """Tell why an update is not taken in, faults included: or calls would wait for ever."""
        done.set_exception(error)
        self._executor().wake()


def _searched(
    meshes: tuple[MeshUpdate, ...], rule: Classification
) -> WorkFuture[tuple[FoundSurfaces, ...]]:
    """What is found in meshes, by a thread that does not outlive the process."""
    work: WorkFuture[tuple[FoundSurfaces, ...]] = WorkFuture()

    def run() -> None:
        try:
            work.set_result(tuple(search(mesh, rule) for mesh in meshes))
        except Exception as error:
            work.set_exception(error)

    threading.Thread(target=run, name="searching", daemon=True).start()
    return work
