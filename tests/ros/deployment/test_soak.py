"""Half a minute of the soak test of `scripts/measure_node.py`: nothing is lost, nothing grows.

Its helpers are used in a domain for this test. No times are compared, since the machine may be
busy.
"""

from __future__ import annotations

import argparse
import importlib
import threading
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from rbprm_msgs.msg import PlanningResult
from rbprm_msgs.srv import Plan

from rbprm_ros.rclpy_utils.qos import CALLS

if TYPE_CHECKING:
    from conftest import Site

SCRIPTS = Path(__file__).resolve().parents[3] / "scripts"
WARM_UP = 5.0  # seconds until buffers, caches and heaps have their size
SECONDS = 20.0
SAMPLING = 0.25  # seconds
MAX_GROWTH = 0.1  # megabytes a second; 0.02 was measured
FAULTS = {PlanningResult.INTERNAL, PlanningResult.INVALID_INPUT, PlanningResult.WORKER_LOST}


@pytest.fixture
def measure(site: Site, monkeypatch: pytest.MonkeyPatch) -> Any:
    """The module `measure_node`, whose planners are in the domain of `site`."""
    monkeypatch.setenv("ROS_DOMAIN_ID", str(site.domain))
    monkeypatch.syspath_prepend(str(SCRIPTS))
    return importlib.import_module("measure_node")


class Memory:
    """Resident memory of processes over time, sampled in a thread."""

    def __init__(self, ids: dict[str, int]) -> None:
        self.samples: dict[str, list[float]] = {name: [] for name in ids}
        self._resident = importlib.import_module("node_soak").resident
        self._ids, self._end = ids, threading.Event()
        self._thread = threading.Thread(target=self._sample)

    def __enter__(self) -> Memory:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._end.set()
        self._thread.join()

    def _sample(self) -> None:
        while not self._end.wait(SAMPLING):
            for name, pid in self._ids.items():
                self.samples[name].append(self._resident(pid))

    def growth(self) -> dict[str, float]:
        """Minimum growth of the processes over the thirds of the time, megabytes a second.

        A leak grows in all thirds; a heap that grows once by a few megabytes, in one.
        """
        return {
            name: min(slope(third) for third in np.array_split(rows, 3))
            for name, rows in self.samples.items()
        }


def slope(rows: Any) -> float:
    """Growth a second: the slope of a line through samples."""
    return float(np.polyfit(SAMPLING * np.arange(len(rows)), rows, 1)[0])


def test_soak(measure: Any) -> None:
    surfaces = measure.field(measure.COLUMNS)
    with measure.planner() as session:
        session.publish_environment(lambda: session.send(*surfaces.values(), is_diff=False))
        session.plan(measure.way(measure.GOAL))
        service = session.node.create_client(Plan, f"{session.name}/plan", qos_profile=CALLS)
        reach(session, service)
        answers = measure.count_answers(service)
        calls = soaked(measure, session, surfaces, service, WARM_UP)
        ids = {"node": session.process.pid, **session.workers()}
        with Memory(ids) as memory:
            calls += soaked(measure, session, surfaces, service, SECONDS)
        assert {"node": session.process.pid, **session.workers()} == ids  # none was lost
        session.wait_for_environment()
        assert session.client.environment().environment_version == session.version
    assert len(answers) == len(calls), "a call was not answered"
    assert set(answers.values()) == {1}
    codes = {call.result().result.code for call in calls}
    assert PlanningResult.SUCCESS in codes
    assert not codes & FAULTS
    growth = memory.growth()
    assert max(growth.values()) < MAX_GROWTH, growth


def reach(session: Any, service: Any) -> None:
    """Repeat an empty request, which is refused, until the planner knows the client.

    The planner may discover the client's reader of answers after the client has found the service.
    """
    session.wait(service.service_is_ready, "the plan service")
    probes: list[Any] = []
    while not any(probe.done() for probe in probes):
        assert len(probes) < 20, "no answer to an empty request"
        probes.append(service.call_async(Plan.Request()))
        session.spinner.spin_until(lambda: any(probe.done() for probe in probes), 2.0)
    for probe in probes:
        service.remove_pending_request(probe)


def soaked(measure: Any, session: Any, surfaces: Any, service: Any, seconds: float) -> list[Any]:
    """Edit at 10 Hz and request plans one after another; returns the calls."""
    options = argparse.Namespace(minutes=seconds / 60.0, rate=10.0, period=0.0)
    calls: list[Any] = measure.soak(session, surfaces, service, options)[0]
    return calls


def test_surfaces_under_load(measure: Any) -> None:
    surfaces = measure.field(measure.COLUMNS)
    with measure.planner(parameters=measure.ENDLESS) as session:
        session.publish_environment(lambda: session.send(*surfaces.values(), is_diff=False))
        call = session.search(measure.TIMEOUT)
        sent, _ = measure.stream(session, 30.0, 3.0)
        session.wait_for_environment()
        assert session.client.environment().environment_version == session.version
        assert sent == 90
        assert not call.done, "the load ended before the surfaces did"
        call.cancel()
        assert call.result(measure.TIMEOUT).result.code == PlanningResult.CANCELLED
