"""The worker's connection to the node during one piece of work."""

from __future__ import annotations

import time
from collections.abc import Sequence

from rbprm_core.body.state import State
from rbprm_core.budget import Progress
from rbprm_core.plan_conversion.states_to_plan import state_entry
from rbprm_core.plan_record import StateEntry
from rbprm_core.processes import Channel, ReportThrottle
from rbprm_core.robot import Robot
from rbprm_ros.workers.jobs import Cancellation, Reported

REPORT_PERIOD = 0.05  # seconds
POLL_PERIOD = 0.01  # seconds between two checks for a cancellation


class WorkLink:
    """Sends the progress of one piece of work to the node and receives its cancellation.

    Args:
        channel: connection to the node.
        work_id: identifier of the work.

    Attributes:
        states: states of the sequence so far, to be sent with the next report; None for none.
    """

    def __init__(self, channel: Channel, work_id: str) -> None:
        self._channel, self._id = channel, work_id
        self._cancelled = False
        self._throttle = ReportThrottle(REPORT_PERIOD)
        self._next_poll = 0.0
        self.states: tuple[StateEntry, ...] | None = None

    @property
    def due(self) -> bool:
        """Whether the next report will be sent."""
        return self._throttle.due

    def report(self, progress: Progress) -> None:
        """Send progress, at most once in a period and a stage.

        Args:
            progress: progress of the work.
        """
        if self._throttle.passes(progress):
            self._channel.send(Reported(self._id, progress, self.states))
            self.states = None

    def cancelled(self) -> bool:
        """Whether the node has cancelled the work."""
        now = time.monotonic()
        if now >= self._next_poll:
            self._next_poll = now + POLL_PERIOD
            while self._channel.has_message():
                message = self._channel.receive()
                assert isinstance(message, Cancellation)  # the node sends no other work meanwhile
                self._cancelled |= message.id == self._id
        return self._cancelled


class GrowingStates:
    """Adds the states of a growing sequence to the next report.

    Args:
        link: connection to the node.
        robot: the robot of the states.
    """

    def __init__(self, link: WorkLink, robot: Robot) -> None:
        self._link, self._robot = link, robot
        self._entries: list[tuple[State, StateEntry]] = []

    def __call__(self, states: Sequence[State]) -> None:
        """Take the states found so far; only new ones are converted."""
        if self._link.due:
            common = 0
            for (known, _), state in zip(self._entries, states, strict=False):
                if known is not state:
                    break
                common += 1
            added = [(state, state_entry(self._robot, state)) for state in states[common:]]
            self._entries[common:] = added
            self._link.states = tuple(entry for _, entry in self._entries)
