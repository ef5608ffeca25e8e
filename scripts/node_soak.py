"""Soak test of the node for `measure_node.py`: changing surfaces, and plan after plan."""

from __future__ import annotations

import argparse
import itertools
import time
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
from planner_session import GOAL, GRACE, INNER, TIMEOUT, Session, way
from rbprm_msgs.msg import Surface
from rclpy.client import Client


def soak(
    session: Session, surfaces: dict[str, Surface], service: Client, options: argparse.Namespace
) -> tuple[list[Any], list[float]]:
    """Edit and request plans until the time is over; returns the calls, and the answer times,
    seconds."""
    futures: list[Any] = []
    seconds: list[float] = []
    columns, minutes = itertools.cycle(INNER), itertools.count()
    start, minute, sent = time.perf_counter(), next(minutes), -np.inf
    for k in range(round(60.0 * options.minutes * options.rate)):
        session.spinner.spin_until(lambda: False, start + k / options.rate - time.perf_counter())
        if k % 2 == 0:
            lost = f"0/{next(columns)}"
            session.send(removed=[lost])
        else:
            session.send(surfaces[lost])
        now = time.perf_counter()
        if len(seconds) == len(futures) and now - sent >= options.period:
            sent = now
            futures.append(service.call_async(way(GOAL, 10.0)))
            futures[-1].add_done_callback(
                lambda _, sent=now: seconds.append(time.perf_counter() - sent)
            )
        if now - start >= 60.0 * minute:
            print_memory(session, str(minute))
            minute = next(minutes)
    session.spinner.spin_until(lambda: len(seconds) == len(futures), TIMEOUT)
    session.spinner.spin_until(lambda: False, GRACE)  # for second answers
    return futures, seconds


def count_answers(service: Client) -> Counter[int]:
    """Number of answers by number of the call; rclpy drops a second answer silently."""
    answers: Counter[int] = Counter()
    pending = service.get_pending_request

    def counted(number: int) -> Any:
        answers[number] += 1
        return pending(number)

    service.get_pending_request = counted
    return answers


def print_memory(session: Session, when: str) -> None:
    """Print a row of the table of resident memory."""
    workers = session.workers()
    ids = (session.process.pid, workers.get("planning"), workers.get("validating"))
    sizes = [0.0 if pid is None else resident(pid) for pid in ids]
    shown = " | ".join(f"{size:.1f}" for size in (*sizes, sum(sizes)))
    print(f"| {when} | {shown} |", flush=True)


def resident(pid: int) -> float:
    """Resident memory of a process, megabytes."""
    lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmRSS:")) / 1024
