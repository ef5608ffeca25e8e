"""The parent's side: a child process and the channel to it.

The child is started by `subprocess`, not by `multiprocessing`, which would run the parent's main
module in the child a second time. It is in a process group of its own, so that Ctrl-C in a terminal
reaches the parent alone, which then ends the child.
"""

from __future__ import annotations

import contextlib
import socket
import subprocess
import sys
from collections.abc import Sequence

from rbprm_core.processes.channel import Channel

STOP_TIMEOUT = 0.5  # seconds that a child has to end by itself, and again after SIGTERM


def module_command(module: str) -> tuple[str, ...]:
    """Command that runs a module with this interpreter, without the current folder on its path."""
    return (sys.executable, "-P", "-m", module)


class ChildProcess:
    """A running child process.

    Args:
        command: program and arguments; the child's file descriptor of the channel follows them.
        arguments: arguments after the file descriptor.
        send_timeout: whole seconds after which sending to the child gives up; None for no limit.

    Attributes:
        channel: the parent's end of the channel.
    """

    def __init__(
        self, command: Sequence[str], *arguments: str, send_timeout: int | None = None
    ) -> None:
        ours, theirs = socket.socketpair()
        with theirs:
            self._popen = subprocess.Popen(
                [*command, str(theirs.fileno()), *arguments],
                pass_fds=[theirs.fileno()],
                process_group=0,
            )
        self.channel = Channel(ours.detach(), send_timeout)

    @property
    def pid(self) -> int:
        """Process id."""
        return self._popen.pid

    @property
    def alive(self) -> bool:
        """Whether the process is running."""
        return self._popen.poll() is None

    def terminate(self) -> None:
        """Send SIGTERM; harmless where the process has ended."""
        self._popen.terminate()

    def kill(self) -> None:
        """Send SIGKILL; harmless where the process has ended."""
        self._popen.kill()

    def wait(self) -> int:
        """Wait until the process ends; returns its exit code, -n where signal n killed it."""
        return self._popen.wait()

    def end(self, by_itself: bool = False) -> int:
        """End the process and reap it; harmless where it has ended.

        SIGTERM is followed by SIGKILL after `STOP_TIMEOUT`.

        Args:
            by_itself: close the channel and give the process `STOP_TIMEOUT` to end by itself,
                before SIGTERM.

        Returns:
            The exit code, -n where signal n killed the process.
        """
        if by_itself:
            self.channel.close()
            with contextlib.suppress(subprocess.TimeoutExpired):
                return self._popen.wait(STOP_TIMEOUT)
        self._popen.terminate()
        try:
            self._popen.wait(STOP_TIMEOUT)
        except subprocess.TimeoutExpired:
            self._popen.kill()
        self.channel.close()
        return self._popen.wait()


def exit_text(code: int) -> str:
    """How a process ended, in words, from its exit code."""
    return f"killed by signal {-code}" if code < 0 else f"exit code {code}"
