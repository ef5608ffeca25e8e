"""Time limit, cancel and progress as one object that is passed along.

The clock only ever ends the work; it never decides what the work does, so that a plan depends on
its request and seed alone.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass

from rbprm_core.errors import Cancelled, InvalidInput, TimeLimitReached


@dataclass(frozen=True)
class Progress:
    """Where the work stands.

    Attributes:
        stage: "robot data", "start", "guide", "shortcut" or "sequence".
        fraction: share of the stage that is done, 0 to 1.
        states: states of the sequence so far.
        elapsed: seconds since the budget was made.
    """

    stage: str
    fraction: float
    states: int
    elapsed: float


MIN_TIME_LIMIT = 1e-3  # seconds


class Budget:
    """What a computation may spend, and whom it tells.

    Args:
        time_limit: seconds, positive; infinity for none.
        cancelled: asked at every check; True ends the work with `Cancelled`.
        report: called with a `Progress` at every check.
    """

    def __init__(
        self,
        time_limit: float = math.inf,
        cancelled: Callable[[], bool] | None = None,
        report: Callable[[Progress], None] | None = None,
    ) -> None:
        if not time_limit > 0:
            raise InvalidInput("time_limit", time_limit, "must be a positive number of seconds")
        self.time_limit = time_limit
        self._cancelled = cancelled
        self._report = report
        self._stage = "start"
        self._start = time.monotonic()

    @property
    def elapsed(self) -> float:
        """Seconds since the budget was made."""
        return time.monotonic() - self._start

    def check(self, stage: str, fraction: float = 0.0, states: int = 0) -> None:
        """Tell the progress, then stop the work where it must stop.

        Raises:
            Cancelled: the caller asked for it.
            TimeLimitReached: the limit has passed.
        """
        self._stage = stage
        if self._report is not None:
            self._report(Progress(stage, fraction, states, self.elapsed))
        self.poll()

    def poll(self) -> None:
        """Stop the work where it must stop: a check that has no progress to tell.

        For work within a step: it has to be asked every few hundredths of a second, so that a
        cancel or the time limit is kept to a tenth.

        Raises:
            Cancelled, TimeLimitReached: as `check`, in the stage that was told last.
        """
        if self._cancelled is not None and self._cancelled():
            raise Cancelled(self._stage)
        if self.elapsed > self.time_limit:
            raise TimeLimitReached(self.time_limit, self._stage)
