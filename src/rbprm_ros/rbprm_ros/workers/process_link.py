"""A running worker process as the node sees it."""

from __future__ import annotations

from dataclasses import replace

from rbprm_core.processes import ChildProcess, module_command
from rbprm_ros.environment.snapshot import Snapshot
from rbprm_ros.environment.snapshot_diff import diff_between
from rbprm_ros.workers.jobs import Cancellation, Job, Validation, Work

COMMAND = module_command("rbprm_ros.workers.worker_process")
MAX_SILENCE = 30.0
"""Seconds after which a busy process counts as hung and is ended: it sends nothing, or receives
nothing of what is sent. It reports every 0.05 s; its longest known pause is the loading of a
robot's meshes."""


class WorkerProcess:
    """A running worker process; keeps track of the environment and the sequence that it holds.

    Args:
        role: last word of its command line.

    Attributes:
        child: the process.
    """

    def __init__(self, role: str) -> None:
        self.child = ChildProcess(COMMAND, role, send_timeout=int(MAX_SILENCE))
        self._snapshot, self._key = Snapshot(), ""

    def send(self, message: Work | Cancellation) -> None:
        """Send a message, without the surfaces and states that the process holds already.

        Args:
            message: work, or a cancellation.

        Raises:
            ChannelClosed: the process has ended.
            PeerHung: the process has received nothing for `MAX_SILENCE` seconds.
        """
        channel = self.child.channel
        if isinstance(message, Job | Validation) and message.snapshot is not None:
            if message.snapshot.version != self._snapshot.version:
                channel.send(diff_between(self._snapshot, message.snapshot))
                self._snapshot = message.snapshot
            message = replace(message, snapshot=None)
        if isinstance(message, Validation):
            if message.key == self._key:
                message = replace(message, states=None)
            self._key = message.key
        channel.send(message)

    def forget_states(self) -> None:
        """Send the states with the next validation: the process may have refused them."""
        self._key = ""
