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
from rbprm_core.stages import Stage


@dataclass(frozen=True)
class Progress:
    """Progress of a computation.

    Attributes:
        stage: name of the present stage, a `rbprm_core.stages.Stage`.
        fraction: share of the stage that is done, 0 to 1.
        states: number of states of the sequence so far.
        elapsed: seconds since the budget was made.
    """

    stage: str
    fraction: float
    states: int
    elapsed: float


MIN_TIME_LIMIT = 1e-3  # seconds


class Budget:
    """Time limit, cancel flag and progress report of a computation.

    Args:
        time_limit: time limit, seconds, positive; infinity for none.
        cancelled: called at every check; True ends the computation with `Cancelled`.
        report: called with a `Progress` at every check.

    Attributes:
        time_limit: time limit, seconds.
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
        self._stage: str = Stage.START
        self._start = time.monotonic()

    @property
    def elapsed(self) -> float:
        """Seconds since the budget was made."""
        return time.monotonic() - self._start

    def check(self, stage: str, fraction: float = 0.0, states: int = 0) -> None:
        """Report the progress, then stop the computation where it must stop.

        Args:
            stage: name of the present stage.
            fraction: share of the stage that is done, 0 to 1.
            states: number of states of the sequence so far.

        Raises:
            Cancelled: the caller requested it.
            TimeLimitReached: the time limit has passed.
        """
        self._stage = stage
        if self._report is not None:
            self._report(Progress(stage, fraction, states, self.elapsed))
        self.poll()

    def poll(self) -> None:
        """Stop the computation where it must stop, without a report of progress.

        To be called every few hundredths of a second, so that a cancel or the time limit takes
        effect within a tenth of a second.

        Raises:
            Cancelled, TimeLimitReached: as `check`, in the stage reported last.
        """
        if self._cancelled is not None and self._cancelled():
            raise Cancelled(self._stage)
        if self.elapsed > self.time_limit:
            raise TimeLimitReached(self.time_limit, self._stage)
