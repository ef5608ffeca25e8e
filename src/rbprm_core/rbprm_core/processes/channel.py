"""One end of the socket pair between a process and its child."""

from __future__ import annotations

import socket
import struct
from collections.abc import Sequence
from multiprocessing.connection import Connection, wait
from typing import Any


class ChannelClosed(OSError):
    """The other end of the channel is closed, mostly because its process has ended."""


class PeerHung(OSError):
    """The process at the other end exists, but neither sends nor receives."""


class Channel:
    """Sends and receives pickled objects.

    Args:
        descriptor: file descriptor of a connected stream socket; the channel closes it.
        send_timeout: whole seconds after which `send` gives up; None waits without limit.
    """

    def __init__(self, descriptor: int, send_timeout: int | None = None) -> None:
        self._send_timeout = send_timeout
        if send_timeout is not None:
            limit = struct.pack("ll", send_timeout, 0)  # struct timeval: seconds, microseconds
            with socket.socket(fileno=descriptor) as end:
                end.setsockopt(socket.SOL_SOCKET, socket.SO_SNDTIMEO, limit)
                descriptor = end.detach()
        self._connection = Connection(descriptor)

    def fileno(self) -> int:
        """The file descriptor of this end."""
        return self._connection.fileno()

    def send(self, message: Any) -> None:
        """Send an object.

        Raises:
            ChannelClosed: the other end is closed.
            PeerHung: the other end has received nothing for `send_timeout` seconds.
        """
        try:
            self._connection.send(message)
        except BlockingIOError as error:
            raise PeerHung(f"it received nothing for {self._send_timeout} s") from error
        except OSError as error:
            raise ChannelClosed(str(error)) from error

    def receive(self) -> Any:
        """Wait for the next object and return it.

        Raises:
            ChannelClosed: the other end is closed.
        """
        try:
            return self._connection.recv()
        except (EOFError, OSError) as error:
            raise ChannelClosed(str(error)) from error

    def has_message(self) -> bool:
        """Whether `receive` would return, or raise, at once.

        Raises:
            ChannelClosed: the other end is closed.
        """
        try:
            return self._connection.poll()
        except OSError as error:
            raise ChannelClosed(str(error)) from error

    def close(self) -> None:
        """Close this end; harmless where it is closed."""
        self._connection.close()


def readable(sources: Sequence[Channel | int], timeout: float) -> list[Channel | int]:
    """The channels and file descriptors that can be read now; waits for one if there is none.

    Args:
        sources: channels and file descriptors.
        timeout: longest time to wait, seconds; the list is empty where it passes.
    """
    return wait(sources, timeout)  # type: ignore[return-value, arg-type]  # stubs lack `fileno`
