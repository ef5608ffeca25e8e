"""SIGINT and SIGTERM as an event that the main loop polls."""

from __future__ import annotations

import signal
import threading
from types import FrameType


def stop_event() -> threading.Event:
    """An event that the first SIGINT or SIGTERM sets; later signals have no effect.

    It replaces rclpy's own handlers: these lose the first signal now and then, and on SIGINT a
    KeyboardInterrupt is raised at any place of the program.
    """
    stop = threading.Event()

    def on_signal(_number: int, _frame: FrameType | None) -> None:
        stop.set()

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, on_signal)
    return stop
