"""One run of a campaign: plan a scenario with a seed, time it, check the plan."""

from __future__ import annotations

import hashlib
import json
import math
import os
import platform
import time
from collections import Counter
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from rbprm_core.bench.failure import failure_of, failure_of_check
from rbprm_core.bench.memory import forget_peak, peak_memory
from rbprm_core.bench.record import LATE, RunFailure, RunRecord, Task
from rbprm_core.budget import Budget
from rbprm_core.check import check_plan
from rbprm_core.errors import RbprmError
from rbprm_core.outcome import Outcome
from rbprm_core.plan_conversion.states_to_plan import contact_plan
from rbprm_core.plan_record import ContactPlan, Statistics
from rbprm_core.planner import plan
from rbprm_core.robot import known_robots
from rbprm_core.robot.data import RobotData, load_robot_data
from rbprm_core.scenario import Scenario, known_scenarios, load_scenario
from rbprm_core.scene import Scene


def run_task(task: Task) -> RunRecord:
    """The record of a task that is run in one thread.

    Robot data and scene stay in the memory of the process for the next task of the same scenario,
    so a process must run one task at a time.

    Args:
        task: scenario, robot, seed and bounds of the run.

    Raises:
        InvalidInput: a scenario or a robot that cannot be used.
    """
    content = _content(task.scenario, known_scenarios())
    scenario, scene = _scenario(task.scenario, content)
    robot = task.robot or scenario.robot
    data = _robot_data(task.scenario, content, task.robot, _content(robot, known_robots()))
    with threadpool_limits(1):
        return measure(scenario, data, scene, task)


def _content(name: str, known: dict[str, Path]) -> bytes:
    """Content of a file by name or path; data kept in memory are valid until it changes."""
    path = known.get(name, Path(name))
    return path.read_bytes() if path.is_file() else b""


@lru_cache(maxsize=1)
def _scenario(scenario: str, content: bytes) -> tuple[Scenario, Scene]:
    """A scenario and its scene; `content` is a part of the key under which they are kept."""
    loaded = load_scenario(scenario)
    return loaded, loaded.scene()


@lru_cache(maxsize=1)
def _robot_data(
    scenario: str, scenario_content: bytes, robot: str | None, robot_content: bytes
) -> RobotData:
    """Data of a scenario's robot; the contents are a part of the key under which they are kept."""
    return load_robot_data(load_scenario(scenario).load_robot(robot))


def measure(scenario: Scenario, data: RobotData, scene: Scene, task: Task) -> RunRecord:
    """The record of planning a scenario once and checking the plan.

    The data that the planner derives from the scene (arrays, bounding volumes) are computed anew in
    every run and count as preparation, so that the first run of a process takes as long as the
    others.

    Args:
        scenario: the scenario.
        data: data of the robot.
        scene: scene of the scenario.
        task: seed and bounds of the run.
    """
    request = scenario.request_for(data.robot, task.seed, task.robustness)
    fresh = Scene(scene.surfaces, scene.obstacles)
    forget_peak()
    wall, cpu = time.perf_counter(), time.thread_time()
    found: Outcome | None = None
    failure: RunFailure | None = None
    statistics = Statistics()
    try:
        found = plan(request, data, fresh, Budget(task.time_limit))
        statistics = found.statistics
    except RbprmError as error:
        failure, statistics = failure_of(error), error.statistics or statistics
    except Exception as error:  # a fault of the planner is recorded and does not end the campaign
        failure = failure_of(error)
    wall, cpu = time.perf_counter() - wall, time.thread_time() - cpu
    record = RunRecord(
        scenario=scenario.name,
        robot=data.robot.name,
        seed=task.seed,
        robustness=task.robustness,
        time_limit=task.time_limit,
        inputs=task.inputs,
        failure=failure,
        seconds=statistics.time,
        wall=wall,
        cpu=cpu,
        counts=statistics.counts,
    )
    if found is not None:
        result = contact_plan(found, request, data.robot, scenario.environment_entry())
        record = _checked(record, result)
    process = f"{platform.node()}:{os.getpid()}"
    return replace(record, peak_memory=peak_memory(), process=process)


def _checked(record: RunRecord, result: ContactPlan) -> RunRecord:
    """The record with the results of the check of the plan."""
    report = check_plan(result)
    failure = failure_of_check(report.violations)
    if failure is None and record.wall > record.time_limit:
        failure = RunFailure(LATE, "", "", f"took {record.wall:.3g} s")
    steps = np.diff([node.position for node in result.guide], axis=0)
    robustness = report.min_robustness
    return replace(
        record,
        failure=failure,
        states=report.states,
        transitions=report.transitions,
        guide_length=float(np.linalg.norm(steps, axis=1).sum()),
        min_robustness=robustness if math.isfinite(robustness) else None,
        violations=dict(Counter(str(violation.kind) for violation in report.violations)),
        support=(report.support.both, report.support.one, report.support.neither),
        overhanging=report.overhanging,
        goal_missing=report.goal_missing,
        digest=plan_digest(result),
    )


def plan_digest(result: ContactPlan) -> str:
    """Hexadecimal digest of a plan's guide and states, equal for equal plans.

    Args:
        result: the plan.
    """
    content = result.model_dump(mode="json", include={"guide", "states"})
    return hashlib.blake2s(json.dumps(content).encode(), digest_size=8).hexdigest()
