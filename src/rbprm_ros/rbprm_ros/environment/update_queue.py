"""Updates of the environment in their order; large meshes are searched in a thread."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future as WorkFuture

from rclpy.executors import Executor
from rclpy.task import Future

from rbprm_core.errors import Cancelled
from rbprm_core.scene import Classification
from rbprm_ros.environment.mesh_search import FoundSurfaces, search_mesh
from rbprm_ros.environment.store import Environment
from rbprm_ros.environment.updates import Limits, MeshUpdate, SurfaceUpdate
from rbprm_ros.rclpy_utils.awaiting import outcome_of

MAX_TRIANGLES_AT_ONCE = 100
"""Triangles of an update that are searched in the executor's thread, in at most 30 ms: most markers
are boxes and the like. More would delay cancellations, answers and statuses."""


class UpdateQueue:
    """Accepts updates one after the other.

    Everything but the search of large meshes runs in the executor's thread.

    Args:
        environment: the environment to update.
        limits: returns the current limits.
        executor: returns the executor that runs the callbacks.
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
        self._searching: Future | None = None  # of the update whose meshes are being searched
        self._newest: Future | None = None

    def add(self, update: SurfaceUpdate) -> Future:
        """Add an update behind those that wait.

        Args:
            update: the update.

        Returns:
            A future that is done when the update is accepted. It raises `InvalidInput`, which names
            the field, where the update is refused, and `Cancelled` where `clear` came first.
        """
        self._newest = Future()
        self._waiting.append((update, self._newest))
        self._proceed()
        return self._newest

    async def settled(self) -> None:
        """Wait until all updates added so far are accepted or refused."""
        newest = self._newest
        if newest is not None and not newest.done():
            done: Future = Future()
            newest.add_done_callback(lambda _: done.set_result(None))
            await done

    def clear(self) -> None:
        """Remove everything from the environment, and all updates from the queue."""
        self._environment.clear()
        pending = [done for _, done in self._waiting]
        if self._searching is not None:
            pending.append(self._searching)
        self._waiting.clear()
        self._searching = None
        for done in pending:
            done.set_exception(Cancelled("waiting"))

    def _proceed(self) -> None:
        """Apply the waiting updates, up to the first with meshes to be searched in a thread."""
        while self._waiting and self._searching is None:
            update, done = self._waiting.popleft()
            meshes = self._environment.unsearched(update)
            if sum(len(mesh.triangles) for mesh in meshes) <= MAX_TRIANGLES_AT_ONCE:
                self._apply(update, (), done)
            else:
                self._searching = done
                self._executor().create_task(self._search(update, meshes, done))

    async def _search(
        self, update: SurfaceUpdate, meshes: tuple[MeshUpdate, ...], done: Future
    ) -> None:
        found: tuple[FoundSurfaces, ...] | Exception
        try:
            found = await outcome_of(
                _search_in_thread(meshes, update.classification), self._executor()
            )
        except Exception as error:
            found = error
        if self._searching is not done:  # the queue was cleared
            return
        self._searching = None
        if isinstance(found, Exception):
            self._refuse(done, found)
        else:
            self._apply(update, found, done)
        self._proceed()

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
        self._executor().wake()  # coroutines that await the future go on when the executor wakes

    def _refuse(self, done: Future, error: Exception) -> None:
        """Fail an update, with unforeseen errors too: calls would wait for it forever."""
        done.set_exception(error)
        self._executor().wake()


def _search_in_thread(
    meshes: tuple[MeshUpdate, ...], rule: Classification
) -> WorkFuture[tuple[FoundSurfaces, ...]]:
    """Search meshes in a daemon thread, which does not outlive the process."""
    work: WorkFuture[tuple[FoundSurfaces, ...]] = WorkFuture()

    def run() -> None:
        try:
            work.set_result(tuple(search_mesh(mesh, rule) for mesh in meshes))
        except Exception as error:
            work.set_exception(error)

    threading.Thread(target=run, name="searching", daemon=True).start()
    return work
