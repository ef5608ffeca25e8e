"""Awaiting the work of another thread or process in a callback."""

from __future__ import annotations

from concurrent.futures import Future as WorkFuture
from typing import TypeVar

from rclpy.executors import Executor
from rclpy.task import Future

T = TypeVar("T")


async def outcome_of(work: WorkFuture[T], executor: Executor) -> T:
    """The result of work, or its exception; other callbacks run meanwhile.

    Args:
        work: future of another thread.
        executor: executor that runs the awaiting coroutine.
    """
    done: Future = Future()

    def wake(_: object) -> None:
        done.set_result(None)
        executor.wake()  # the coroutine goes on when the executor wakes

    work.add_done_callback(wake)
    await done
    return work.result()
