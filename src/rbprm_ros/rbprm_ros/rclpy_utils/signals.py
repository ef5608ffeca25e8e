"""SIGINT and SIGTERM as an event that the main loop looks at."""

from __future__ import annotations

import signal
import threading
from types import FrameType


def stop_event() -> threading.Event:
    """An event that the first signal to stop sets; later ones change nothing.

    In the place of rclpy's own handlers: they now and then lose the first signal, and on SIGINT
    KeyboardInterrupt comes wherever the program happens to be.
    """
    stop = threading.Event()

    def on_signal(_number: int, _frame: FrameType | None) -> None:
        stop.set()

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, on_signal)
    return stop
