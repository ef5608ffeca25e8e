"""The child's side: its main function, and how often it reports progress."""

from __future__ import annotations

import contextlib
import signal
import sys
import time
from collections.abc import Callable

from rbprm_core.budget import Progress
from rbprm_core.processes.channel import Channel, ChannelClosed


def serve_parent(serve: Callable[[Channel], None]) -> None:
    """Run a child's main function on the channel that its command line names.

    The child ends when its parent closes the channel or exits. SIGINT is ignored: Ctrl-C is for
    the parent, which then ends the child.

    Args:
        serve: main function; `ChannelClosed`, raised in it, ends the child silently.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with contextlib.suppress(ChannelClosed):
        serve(Channel(int(sys.argv[1])))


class ReportThrottle:
    """Lets progress pass at most once in a period and a stage.

    The planner reports at every check of its budget, much more often than a report is read.

    Args:
        period: seconds between two reports of one stage.
    """

    def __init__(self, period: float) -> None:
        self._period = period
        self._stage, self._next = "", 0.0

    @property
    def due(self) -> bool:
        """Whether a report of the same stage would pass now."""
        return time.monotonic() >= self._next

    def passes(self, progress: Progress) -> bool:
        """Whether a report is to be sent; if so, the period begins anew."""
        if progress.stage == self._stage and not self.due:
            return False
        self._stage, self._next = progress.stage, time.monotonic() + self._period
        return True
