"""Planning with a real worker process and without a node."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
import pytest
from rclpy.executors import SingleThreadedExecutor

from rbprm_core.errors import Cancelled
from rbprm_core.guide.root_space import RootBounds
from rbprm_core.placement import Placement
from rbprm_core.plan_record import SurfaceEntry
from rbprm_core.request import PlanRequest
from rbprm_ros.environment.store import Environment
from rbprm_ros.environment.updates import SurfaceUpdate
from rbprm_ros.planning.planning import Planning
from rbprm_ros.planning.sequence import PublishedSequence
from rbprm_ros.planning.status import Activity
from rbprm_ros.planning.validator import ignore
from rbprm_ros.settings import Settings
from rbprm_ros.workers.jobs import Job, RobotChoice

if TYPE_CHECKING:
    from conftest import Site

LIMBS = ("lf_leg", "rf_leg", "lh_leg", "rh_leg")
GROUND = ((-2.0, -2.0, 0.0), (4.0, -2.0, 0.0), (4.0, 2.0, 0.0), (-2.0, 2.0, 0.0))


@pytest.fixture
def executor(site: Site) -> Iterator[SingleThreadedExecutor]:
    made = SingleThreadedExecutor(context=site.context)
    yield made
    made.shutdown()


def test_plan_that_comes_as_the_node_stops_is_not_published(
    executor: SingleThreadedExecutor,
) -> None:
    environment, published = Environment(), list[PublishedSequence]()
    environment.update(SurfaceUpdate((SurfaceEntry(id="ground", vertices=GROUND),)), Settings())
    planning = Planning(
        Settings,
        time.time_ns,
        environment,
        lambda: executor,
        published.append,
        lambda: None,
        ignore,
    )
    planning.activate()
    works = []
    task = executor.create_task(planning.calls.plan(walk(environment), submitted=works.append))
    while not works:
        executor.spin_once(0.1)
    assert works[0].result(60.0) is not None  # it has come, but is not published yet
    planning.close()
    while not task.done():
        with contextlib.suppress(Cancelled):  # the executor raises the exceptions of tasks
            executor.spin_once(0.1)
    assert isinstance(task.exception(), Cancelled)
    assert published == []
    assert planning.tracker.status.activity is Activity.IDLE


def walk(environment: Environment) -> Job:
    """HyQ, one metre ahead."""
    request = PlanRequest(
        start=Placement.parse((0, 0, 0.6)),
        goal=Placement.parse((1, 0, 0.6)),
        bounds=RootBounds(np.array([-1, -1, 0]), np.array([3, 1, 1]), np.full(3, 0.3)),
        required_limbs=LIMBS,
        start_limbs=LIMBS,
        robustness_threshold=10.0,
    )
    return Job("walk", RobotChoice("hyq"), request, 60.0, environment.snapshot)
