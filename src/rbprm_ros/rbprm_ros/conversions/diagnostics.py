"""The node's health as a message for /diagnostics."""

from __future__ import annotations

from dataclasses import dataclass

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from std_msgs.msg import Header

LONG_QUEUE = 5  # calls; more calls wait longer than an executive expects


@dataclass(frozen=True)
class Health:
    """The health of the node.

    Attributes:
        worker_alive: whether both worker processes are running.
        restarts: number of worker processes that were lost since the node was configured.
        environment_version: number of changes of the environment.
        environment_age: time since the newest message about the environment, seconds; None before
            the first.
        rejection: why the newest message was refused; "" where it was accepted.
        planning_time: planning time of the published sequence, seconds; None where there is none.
        queue: number of calls and goals that wait or are served.
    """

    worker_alive: bool
    restarts: int
    environment_version: int
    environment_age: float | None
    rejection: str
    planning_time: float | None
    queue: int


def diagnostics_message(health: Health, header: Header, node: str) -> DiagnosticArray:
    """A message with three statuses: planning process, environment, and queue of calls.

    Args:
        health: the health of the node.
        header: header with the time of the diagnostics.
        node: name of the node.
    """
    statuses = (_process(health), _environment(health), _queue(health))
    for status in statuses:
        status.name, status.hardware_id = f"{node}: {status.name}", "none"
    return DiagnosticArray(header=header, status=list(statuses))


def _process(health: Health) -> DiagnosticStatus:
    level, text = DiagnosticStatus.OK, "runs"
    if not health.worker_alive:
        level, text = DiagnosticStatus.ERROR, "has died; the next call starts a new one"
    elif health.restarts:
        level, text = DiagnosticStatus.WARN, f"was started again {health.restarts} times"
    values = {
        "restarts": health.restarts,
        "last planning time [s]": _seconds_text(health.planning_time),
    }
    return _status("planning process", level, text, values)


def _environment(health: Health) -> DiagnosticStatus:
    level, text = DiagnosticStatus.OK, f"version {health.environment_version}"
    if health.rejection:
        level, text = DiagnosticStatus.ERROR, f"newest message refused: {health.rejection}"
    elif not health.environment_version:
        level, text = DiagnosticStatus.WARN, "nothing received: publish on ~/surfaces"
    age = _seconds_text(health.environment_age)
    return _status(
        "environment", level, text, {"version": health.environment_version, "age [s]": age}
    )


def _queue(health: Health) -> DiagnosticStatus:
    level, text = DiagnosticStatus.OK, f"{health.queue} calls"
    if health.queue > LONG_QUEUE:
        level, text = DiagnosticStatus.WARN, f"{health.queue} calls wait: send fewer, or cancel"
    return _status("queue", level, text, {"length": health.queue})


def _status(name: str, level: bytes, text: str, values: dict[str, object]) -> DiagnosticStatus:
    pairs = [KeyValue(key=key, value=str(value)) for key, value in values.items()]
    return DiagnosticStatus(name=name, level=level, message=text, values=pairs)


def _seconds_text(seconds: float | None) -> str:
    return "" if seconds is None else f"{seconds:.3f}"
