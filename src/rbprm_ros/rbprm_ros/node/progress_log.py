"""Progress in the log: of robot data, which take long once, at level info; of stages at debug."""

from __future__ import annotations

from rclpy.impl.rcutils_logger import RcutilsLogger

from rbprm_core.budget import Progress

PARTS = 10  # largest number of lines about one stage


class ProgressLog:
    """Writes progress to the log, one line for every tenth of a stage.

    Args:
        logger: the log.
        subject: name of the work, at the beginning of every line.
    """

    def __init__(self, logger: RcutilsLogger, subject: str) -> None:
        self._logger, self._subject = logger, subject
        self._last = ("", -1)

    def __call__(self, progress: Progress) -> None:
        """Write a line, if progress has reached another tenth or stage."""
        current = (progress.stage, int(progress.fraction * PARTS))
        if current == self._last:
            return
        self._last = current
        note = f", {progress.states} states" if progress.states else ""
        line = f"{self._subject}: {progress.stage} {progress.fraction:.0%}{note}"
        if progress.stage == "robot data":
            self._logger.info(line)
        else:
            self._logger.debug(line)
