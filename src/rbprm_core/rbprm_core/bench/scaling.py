"""How planning time grows with the length of the way, and with the surfaces around it."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from rbprm_core.bench.machine import Machine, this_machine
from rbprm_core.bench.record import RunRecord, Task
from rbprm_core.bench.run import measure
from rbprm_core.bench.variants import longer, surrounded
from rbprm_core.errors import InvalidInput
from rbprm_core.robot.data import RobotData, load_robot_data
from rbprm_core.scenario import Scenario, load_scenario
from rbprm_core.scene import Scene

LENGTHS = (1, 2, 4, 8)
SURFACES = (10, 100, 1_000, 10_000)
PHASES = ("prepare", "guide", "shortcut", "sequence")
PROCESSOR = "processor"
"""Processor time of planning as a whole, which what else runs on the machine disturbs least."""
BLOCK = Path(__file__).with_name("block.toml")


@dataclass(frozen=True)
class Size:
    """One size of the problem.

    Attributes:
        size: what grows: metres from start to goal, or number of surfaces around the way.
        surfaces: of the scene in all.
        reading: processor seconds to make surfaces of the environment, before planning.
        records: a run each seed.
    """

    size: float
    surfaces: int
    reading: float
    records: tuple[RunRecord, ...]

    def seconds(self, phase: str) -> float:
        """Median seconds of a phase, or of PROCESSOR, over the successes; NaN without any."""
        found = [
            run.cpu if phase == PROCESSOR else run.seconds[phase]
            for run in self.records
            if run.success
        ]
        return float(np.median(found)) if found else float("nan")

    @property
    def successes(self) -> int:
        """Number of runs that succeeded."""
        return sum(run.success for run in self.records)


@dataclass(frozen=True)
class Growth:
    """Planning time over sizes.

    Attributes:
        name: "length" or "surfaces". unit: of the sizes.
    """

    name: str
    unit: str
    machine: Machine
    sizes: tuple[Size, ...]

    def exponent(self, phase: str = PROCESSOR) -> float:
        """p of the power law t = c size^p that fits best (least squares of logarithms)."""
        return self._slope(phase, self.sizes)

    def last_exponent(self, phase: str = PROCESSOR) -> float:
        """p between the two greatest sizes, where what is constant weighs least."""
        return self._slope(phase, self.sizes[-2:])

    def _slope(self, phase: str, sizes: Sequence[Size]) -> float:
        x = np.log([size.size for size in sizes])
        y = np.log([size.seconds(phase) for size in sizes])
        return float(np.polyfit(x, y, 1)[0]) if np.isfinite(y).all() else float("nan")


def growth_with_length(
    sizes: Sequence[int] = LENGTHS,
    seeds: Sequence[int] = range(3),
    on_record: Callable[[RunRecord], None] = lambda record: None,
    robot: str | None = None,
) -> Growth:
    """The rubble repeated that many times along the way.

    Args:
        robot: a robot file instead of HyQ's; start, goal and bounds stay HyQ's.
    """
    text = load_scenario("rubble")
    span = text.request.goal.position[0] - text.request.start.position[0]
    variants = [(times * span, longer(text, times)) for times in _checked(sizes)]
    return _growth("length", "m", variants, seeds, on_record, robot)


def growth_with_surfaces(
    sizes: Sequence[int] = SURFACES,
    seeds: Sequence[int] = range(3),
    on_record: Callable[[RunRecord], None] = lambda record: None,
    robot: str | None = None,
) -> Growth:
    """A way round a block, with that many surfaces out of reach to both sides.

    Args:
        robot: a robot file instead of HyQ's; start, goal and bounds stay HyQ's.
    """
    text = load_scenario(str(BLOCK))
    variants = [(float(count), surrounded(text, count)) for count in _checked(sizes)]
    return _growth("surfaces", "surfaces", variants, seeds, on_record, robot)


def _growth(
    name: str,
    unit: str,
    variants: Sequence[tuple[float, Scenario]],
    seeds: Sequence[int],
    on_record: Callable[[RunRecord], None],
    robot: str | None,
) -> Growth:
    machine = this_machine()
    data = load_robot_data(variants[0][1].load_robot(robot))
    scenes, reading = [], []
    for _, text in variants:
        start = time.thread_time()
        scenes.append(text.scene())
        reading.append(time.thread_time() - start)
    records: list[list[RunRecord]] = [[] for _ in variants]
    with threadpool_limits(1):
        for seed in seeds:  # all sizes, then the next seed: what disturbs, disturbs them all
            for (_, text), scene, runs in zip(variants, scenes, records, strict=True):
                runs.append(_run(text, data, scene, seed))
                on_record(runs[-1])
    sizes = [
        Size(size, len(scene.surfaces), seconds, tuple(runs))
        for (size, _), scene, seconds, runs in zip(variants, scenes, reading, records, strict=True)
    ]
    return Growth(name, unit, machine, tuple(sizes))


def _run(text: Scenario, data: RobotData, scene: Scene, seed: int) -> RunRecord:
    request = text.request
    task = Task(text.name, None, seed, request.robustness_threshold, request.time_limit)
    return measure(text, data, scene, task)


def _checked(sizes: Sequence[int]) -> Sequence[int]:
    if len(sizes) < 2 or min(sizes) < 1:
        raise InvalidInput("sizes", list(sizes), "at least two positive ones are needed")
    return sizes
