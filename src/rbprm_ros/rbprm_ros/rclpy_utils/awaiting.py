"""Work of another thread or process, awaited in a callback."""

from __future__ import annotations

from concurrent.futures import Future as WorkFuture
from typing import TypeVar

from rclpy.executors import Executor
from rclpy.task import Future

T = TypeVar("T")


async def outcome_of(work: WorkFuture[T], executor: Executor) -> T:
    """What work gives, or raises; the executor's other callbacks run meanwhile."""
    done: Future = Future()

    def wake(_: object) -> None:
        done.set_result(None)
        executor.wake()  # a coroutine goes on when its executor looks, not by itself

    work.add_done_callback(wake)
    await done
    return work.result()
