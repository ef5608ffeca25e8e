"""Child processes and the channel to them."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Iterator

import pytest

from rbprm_core.budget import Progress
from rbprm_core.processes import (
    ChannelClosed,
    ChildProcess,
    PeerHung,
    ReportThrottle,
    exit_text,
    module_command,
    readable,
)

ECHO = """
from rbprm_core.processes import serve_parent
def serve(channel):
    channel.send("ready")
    while True:
        channel.send(channel.receive())
serve_parent(serve)
"""
DEAF = """
import signal, sys, time
from rbprm_core.processes import Channel
signal.signal(signal.SIGTERM, signal.SIG_IGN)
channel = Channel(int(sys.argv[1]))
channel.send("ready")
time.sleep(600)
"""
TIMEOUT = 60.0  # seconds until a child has started or ended


def start(script: str, send_timeout: int | None = None) -> ChildProcess:
    """A child that runs a script and has said that it is ready."""
    child = ChildProcess([sys.executable, "-c", script], send_timeout=send_timeout)
    assert readable([child.channel], TIMEOUT)
    assert child.channel.receive() == "ready"
    return child


@pytest.fixture
def echo() -> Iterator[ChildProcess]:
    """A child that sends back what it receives."""
    child = start(ECHO)
    yield child
    child.kill()
    child.end()


@pytest.fixture
def deaf() -> Iterator[ChildProcess]:
    """A child that receives nothing and ignores SIGTERM."""
    child = start(DEAF, send_timeout=1)
    yield child
    child.kill()
    child.end()


def test_objects_cross_the_channel(echo: ChildProcess) -> None:
    echo.channel.send({"limbs": ("lf", "rf")})
    assert echo.channel.receive() == {"limbs": ("lf", "rf")}
    assert not echo.channel.has_message()


def test_a_child_ends_when_its_channel_closes(echo: ChildProcess) -> None:
    assert echo.end(by_itself=True) == 0
    assert not echo.alive
    assert echo.end() == 0  # again


def test_a_child_is_in_a_process_group_of_its_own_and_ignores_sigint(echo: ChildProcess) -> None:
    assert os.getpgid(echo.pid) == echo.pid
    os.kill(echo.pid, signal.SIGINT)
    echo.channel.send(1)
    assert echo.channel.receive() == 1


def test_a_child_that_died_closes_the_channel(echo: ChildProcess) -> None:
    echo.kill()
    assert exit_text(echo.wait()) == "killed by signal 9"
    with pytest.raises(ChannelClosed):
        echo.channel.receive()
    with pytest.raises(ChannelClosed):
        echo.channel.send(1)


def test_a_child_that_ignores_sigterm_is_killed(deaf: ChildProcess) -> None:
    assert deaf.end(by_itself=True) == -signal.SIGKILL


def test_sending_to_a_child_that_receives_nothing_gives_up(deaf: ChildProcess) -> None:
    with pytest.raises(PeerHung, match="received nothing for 1 s"):
        deaf.channel.send(bytes(10**7))


def test_a_module_runs_without_the_current_folder_on_its_path() -> None:
    assert module_command("a.b") == (sys.executable, "-P", "-m", "a.b")


def test_reports_pass_once_in_a_period_and_a_stage() -> None:
    throttle = ReportThrottle(3600.0)
    assert throttle.passes(Progress("guide", 0.0, 0, 0.0))
    assert not throttle.due
    assert not throttle.passes(Progress("guide", 0.5, 0, 0.1))
    assert throttle.passes(Progress("sequence", 0.0, 0, 0.2))
    assert ReportThrottle(0.0).due
