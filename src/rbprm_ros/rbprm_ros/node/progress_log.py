"""Progress as log lines: robot data, which take long once, for all; stages for who debugs."""

from __future__ import annotations

from rclpy.impl.rcutils_logger import RcutilsLogger

from rbprm_core.budget import Progress

PARTS = 10  # lines that the making of robot data writes at most


class ProgressLog:
    """Told progress, writes a line where there is something new to read.

    Args:
        subject: what is being worked on, at the beginning of every line.
    """

    def __init__(self, logger: RcutilsLogger, subject: str) -> None:
        self._logger, self._subject = logger, subject
        self._last = ("", -1)

    def __call__(self, progress: Progress) -> None:
        """Take progress in."""
        news = (progress.stage, int(progress.fraction * PARTS))
        if news == self._last:
            return
        self._last = news
        note = f", {progress.states} states" if progress.states else ""
        line = f"{self._subject}: {progress.stage} {progress.fraction:.0%}{note}"
        if progress.stage == "robot data":
            self._logger.info(line)
        else:
            self._logger.debug(line)
