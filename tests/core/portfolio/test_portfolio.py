"""A portfolio in real processes: the winner, the error if none succeeds, and that all end."""

from __future__ import annotations

import os
import pickle
import re
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rbprm_core.budget import Budget, Progress
from rbprm_core.errors import (
    Cancelled,
    GoalUnreachable,
    InvalidInput,
    NoGuideFound,
    NoSequenceFound,
    RbprmError,
    StartUnreachable,
    TimeLimitReached,
)
from rbprm_core.failures import Cause, Failure
from rbprm_core.guide.guide_options import GuideOptions, RrtOptions
from rbprm_core.guide.root import RootBounds
from rbprm_core.placement import Placement
from rbprm_core.planner import plan
from rbprm_core.portfolio.portfolio import ProcessDied, how_far, plan_portfolio
from rbprm_core.request import PlannerOptions, PlanRequest
from rbprm_core.robot.data import RobotData
from rbprm_core.scene import Scene, make_surface

COLLISION = Failure.of(Cause.ROOT_COLLISION)
KINEMATICS = Failure.of(Cause.NO_KINEMATIC_SOLUTION, "lf")
BOUNDS = RootBounds(np.array([-3, -0.1, 0.2]), np.array([8, 0.1, 0.6]), np.full(3, 0.2))


def request_to(data: RobotData, x: float, seed: int, **options: object) -> PlanRequest:
    """The toy robot from the origin to somewhere ahead."""
    limbs = tuple(limb.name for limb in data.robot.limbs)
    start, goal = (Placement.parse([at, 0.0, 0.42]) for at in (0.0, x))
    chosen = PlannerOptions(**options)  # type: ignore[arg-type]
    return PlanRequest(start, goal, BOUNDS, limbs, limbs, 2.0, seed=seed, options=chosen)


def gap() -> Scene:
    """Two grounds too far apart for any guide between them."""
    grounds = []
    for name, low, high in (("here", -2.0, 2.0), ("there", 5.0, 7.0)):
        corners = [(low, -2, 0), (high, -2, 0), (high, 2, 0), (low, 2, 0)]
        grounds.append(make_surface(name, corners, 0.5))
    return Scene(grounds)


def endless(data: RobotData) -> PlanRequest:
    """A request whose guide is searched for in vain for hours."""
    search = GuideOptions(rrt=RrtOptions(iterations=10**9))
    return request_to(data, 6.0, 0, guide=search)


BEFORE: set[int] = set()  # processes that other tests started and left running, such as a pool


@pytest.fixture(autouse=True)
def remember_who_runs() -> None:
    BEFORE.clear()
    BEFORE.update(children(os.getpid()))


def children(process: int) -> set[int]:
    """Processes that a process has started in this test and that still run."""
    found = set()
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, parent = stat.read_text().rsplit(")", 1)[1].split()[:2]
        except OSError:
            continue
        if int(parent) == process and state != "Z":
            found.add(int(stat.parent.name))
    return found - BEFORE


def gone(processes: set[int], within: float) -> bool:
    """Whether processes end within some seconds."""
    end = time.monotonic() + within
    while time.monotonic() < end:
        if not any(Path(f"/proc/{process}/cmdline").exists() for process in processes):
            return True
        time.sleep(0.05)
    return False


def test_the_first_success_wins_and_its_seed_alone_gives_the_same_plan(
    toy_data: RobotData, flat_scene: Scene
) -> None:
    asked = request_to(toy_data, 0.8, seed=7)
    seen: dict[int, list[Progress]] = {}
    request, outcome = plan_portfolio(
        asked, toy_data, flat_scene, 60.0, 2, lambda seed, p: seen.setdefault(seed, []).append(p)
    )
    assert request.seed in (7, 8)
    assert set(seen) <= {7, 8}
    assert seen[request.seed][-1].stage == "sequence"
    assert children(os.getpid()) == set()
    alone = plan(replace(asked, seed=request.seed), toy_data, flat_scene, Budget(60.0))
    assert len(alone.states) == len(outcome.states)
    for one, other in zip(alone.states, outcome.states, strict=True):
        assert (one.q == other.q).all()
        assert one.robustness == other.robustness
        for a, b in zip(one.contacts, other.contacts, strict=True):
            assert (a.limb, a.surface) == (b.limb, b.surface)
            assert (a.points == b.points).all()
    assert (alone.guide.nodes == outcome.guide.nodes).all()


def test_where_all_fail_the_farthest_is_told(toy_data: RobotData) -> None:
    """Between two grounds a bridge for the left feet only: a guide that asks no more can cross."""
    bridge = [(1.5, 0.1, 0), (5.5, 0.1, 0), (5.5, 0.5, 0), (1.5, 0.5, 0)]
    scene = Scene([*gap().surfaces, make_surface("bridge", bridge, 0.5)])
    asked = replace(request_to(toy_data, 6.0, 0, guides=1), required_limbs=("lf", "lh"))
    alone = []
    for seed in (0, 1):
        with pytest.raises(NoSequenceFound) as one:
            plan(replace(asked, seed=seed), toy_data, scene, Budget(60.0))
        alone.append(one.value)
    for limit in (3.0, 10.0, 30.0, 90.0):  # seconds, until the machine has time for four seeds
        seeds: set[int] = set()
        with pytest.raises((NoSequenceFound, TimeLimitReached)) as caught:
            plan_portfolio(asked, toy_data, scene, limit, 2, lambda seed, _: seeds.add(seed))  # noqa: B023
        if {0, 1, 2, 3} <= seeds:
            break
    assert {0, 1, 2, 3} <= seeds
    best = max(alone, key=lambda error: error.fraction)
    assert caught.value.fraction >= best.fraction
    assert len(caught.value.states) > 1


def test_a_seed_that_fails_early_gives_its_place_to_another(
    toy_data: RobotData, flat_scene: Scene
) -> None:
    """Two samples find the way round a wall with few seeds; the one that does is named."""
    low, high = (0.7, -2.0), (0.7, 0.6)
    ring = [(*low, 0.0), (*high, 0.0), (*high, 1.5), (*low, 1.5)]
    walls = [make_surface("front", ring[::-1], 0.5), make_surface("back", ring, 0.5)]
    scene = Scene([*flat_scene.surfaces, *walls])
    bounds = RootBounds(np.array([-1, -2, 0.2]), np.array([3, 2, 0.6]), np.full(3, 0.2))
    search = GuideOptions(rrt=RrtOptions(iterations=12))
    asked = replace(request_to(toy_data, 1.5, 0, guide=search, guides=1), bounds=bounds)
    with pytest.raises(NoGuideFound):
        plan(asked, toy_data, scene, Budget(60.0))
    request, outcome = plan_portfolio(asked, toy_data, scene, 60.0, 1)
    assert request.seed > 0
    alone = plan(request, toy_data, scene, Budget(60.0))
    assert (alone.guide.nodes == outcome.guide.nodes).all()
    assert [state.robustness for state in alone.states] == [
        state.robustness for state in outcome.states
    ]


def test_how_far_an_attempt_came_is_the_share_of_its_guide() -> None:
    late = TimeLimitReached(1.0, "sequence")
    late.states, late.fraction = (1, 2), 0.7
    stopped = NoSequenceFound(3, COLLISION, 0.5, (1, 2, 3))
    early = TimeLimitReached(1.0, "guide")
    assert sorted([late, early, stopped], key=how_far) == [early, stopped, late]


def test_the_time_limit_holds(toy_data: RobotData) -> None:
    with pytest.raises(TimeLimitReached, match=r"limit of 0\.3 s reached in stage \w+"):
        plan_portfolio(endless(toy_data), toy_data, gap(), 0.3, 2)
    assert children(os.getpid()) == set()


def test_cancelling_and_dying(toy_data: RobotData) -> None:
    planning: set[int] = set()

    def note(seed: int, progress: Progress) -> None:
        if progress.stage == "guide":
            planning.add(seed)

    with pytest.raises(Cancelled):
        plan_portfolio(
            endless(toy_data), toy_data, gap(), 60.0, 2, note, lambda: planning == {0, 1}
        )
    assert children(os.getpid()) == set()

    def kill(seed: int, progress: Progress) -> None:
        for process in children(os.getpid()):
            os.kill(process, signal.SIGKILL)

    with pytest.raises(ProcessDied, match="killed by signal 9"):
        plan_portfolio(endless(toy_data), toy_data, gap(), 60.0, 1, kill)


@pytest.mark.parametrize(("jobs", "limit"), [(0, 1.0), (-1, 1.0), (10**6, 1.0), (2, 0.0)])
def test_bad_numbers_are_refused(
    toy_data: RobotData, flat_scene: Scene, jobs: int, limit: float
) -> None:
    with pytest.raises(InvalidInput):
        plan_portfolio(request_to(toy_data, 0.5, 0), toy_data, flat_scene, limit, jobs)


ENDLESS = """name = "endless"
robot = "{robot}"
[[environment.surfaces]]
id = "here"
vertices = [[-2.0, -2.0, 0.0], [2.0, -2.0, 0.0], [2.0, 2.0, 0.0], [-2.0, 2.0, 0.0]]
[[environment.surfaces]]
id = "there"
vertices = [[5.0, -2.0, 0.0], [7.0, -2.0, 0.0], [7.0, 2.0, 0.0], [5.0, 2.0, 0.0]]
[request]
start = {{ position = [0.0, 0.0, 0.42] }}
goal = {{ position = [6.0, 0.0, 0.42] }}
bounds = {{ x = [-3.0, 8.0], y = [-0.1, 0.1], z = [0.2, 0.6], yaw = 0.2, pitch = 0.2, roll = 0.2 }}
[options]
guide = {{ rrt = {{ iterations = 1000000000 }} }}
"""


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGKILL])
def test_no_process_outlives_the_command(
    how: signal.Signals, toy_file: Path, toy_data: RobotData, tmp_path: Path
) -> None:
    """Ctrl-C ends them; so does the end of a command that had no chance to end them."""
    file = tmp_path / "endless.toml"
    file.write_text(ENDLESS.format(robot=toy_file))
    arguments = ["plan", str(file), "--jobs", "2", "--time-limit", "300"]
    bars, errors_file = tmp_path / "bars", tmp_path / "errors"
    with bars.open("w") as out, errors_file.open("w") as err:
        process = subprocess.Popen(
            [sys.executable, "-m", "rbprm_core.cli.main", *arguments],
            stdout=out,
            stderr=err,
            env={**os.environ, "TERM": "xterm", "FORCE_COLOR": "1", "COLUMNS": "200"},
        )
    try:
        # Once both seeds search for a guide, signals are handled and nothing is being started.
        end = time.monotonic() + 120
        while set(re.findall(r"seed (\d)[^\n]*guide", bars.read_text())) != {"0", "1"}:
            assert process.poll() is None, errors_file.read_text()
            assert time.monotonic() < end, bars.read_text()
            time.sleep(0.05)
        started = children(process.pid)
        assert len(started) == 2
        process.send_signal(how)
        process.wait(timeout=60)
    finally:
        process.kill()
        process.wait(timeout=60)
    assert gone(started, within=60)
    errors = errors_file.read_text()
    assert "Traceback" not in errors
    if how == signal.SIGINT:
        assert process.returncode == 130
        assert "interrupted" in errors


@pytest.mark.parametrize(
    "error",
    [
        InvalidInput("goal.x", 3, "is far"),
        StartUnreachable(Failure.of(Cause.LIMB_COLLISION, "lf")),
        GoalUnreachable(COLLISION),
        NoGuideFound(
            Failure.of(Cause.TREES_NOT_CONNECTED, samples=30, start_nodes=2, goal_nodes=1), 3
        ),
        NoSequenceFound(4, KINEMATICS, 0.4, (1, 2)),
        TimeLimitReached(3.0, "guide", NoSequenceFound(4, KINEMATICS, 0.4)),
        Cancelled("guide"),
        ProcessDied(3, -9),
    ],
)
def test_errors_travel_between_processes(error: RbprmError) -> None:
    again = pickle.loads(pickle.dumps(error))
    assert type(again) is type(error)
    assert str(again) == str(error)
    assert again.code == error.code
    assert again.failure == error.failure
    for name, value in vars(error).items():
        assert str(getattr(again, name)) == str(value)
