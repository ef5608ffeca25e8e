"""Growth of planning time with the length of the path and with the number of surfaces."""

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

LENGTHS = (1, 2, 4, 8)  # repetitions of the rubble
SURFACES = (10, 100, 1_000, 10_000)  # tiles beside the path
PHASES = ("prepare", "guide", "shortcut", "sequence")
PROCESSOR = "processor"
"""Processor time of planning as a whole; other programs on the machine influence it little."""
BLOCK = Path(__file__).with_name("block.toml")


@dataclass(frozen=True)
class Size:
    """The runs of one size of the problem.

    Attributes:
        size: distance from start to goal in metres, or number of surfaces beside the path.
        surfaces: number of all surfaces of the scene.
        reading: processor time of making surfaces of the environment, before planning, seconds.
        records: records of the runs, one for each seed.
    """

    size: float
    surfaces: int
    reading: float
    records: tuple[RunRecord, ...]

    def seconds(self, phase: str) -> float:
        """Median time of a phase over the successful runs, seconds; NaN without any.

        Args:
            phase: name of a phase of the planner, "total" or `PROCESSOR`.
        """
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
    """Planning times for several sizes of a problem.

    Attributes:
        name: "length" or "surfaces".
        unit: unit of the sizes.
        machine: machine of the measurement.
        sizes: runs of each size, in increasing order.
    """

    name: str
    unit: str
    machine: Machine
    sizes: tuple[Size, ...]

    def exponent(self, phase: str = PROCESSOR) -> float:
        """Exponent $p$ of the power law $t = c x^p$ of time $t$ over size $x$.

        It is fitted to all sizes by least squares of the logarithms; NaN where a size has no
        success.

        Args:
            phase: name of a phase of the planner, "total" or `PROCESSOR`.
        """
        return self._slope(phase, self.sizes)

    def last_exponent(self, phase: str = PROCESSOR) -> float:
        """Exponent $p$ between the two largest sizes, where constant costs matter least.

        Args:
            phase: name of a phase of the planner, "total" or `PROCESSOR`.
        """
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
    """Planning times over the rubble, repeated along the path.

    Args:
        sizes: numbers of repetitions, in increasing order; at least two.
        seeds: seeds of the runs.
        on_record: function called with the record of every run as it ends.
        robot: name or file of a robot instead of HyQ; start, goal and bounds are those for HyQ.

    Raises:
        InvalidInput: sizes or a robot that cannot be used.
    """
    scenario = load_scenario("rubble")
    span = scenario.request.goal.position[0] - scenario.request.start.position[0]
    variants = [(times * span, longer(scenario, times)) for times in _checked(sizes)]
    return _growth("length", "m", variants, seeds, on_record, robot)


def growth_with_surfaces(
    sizes: Sequence[int] = SURFACES,
    seeds: Sequence[int] = range(3),
    on_record: Callable[[RunRecord], None] = lambda record: None,
    robot: str | None = None,
) -> Growth:
    """Planning times of a path round a block, with surfaces out of reach on both sides.

    Args:
        sizes: numbers of surfaces, in increasing order; at least two.
        seeds: seeds of the runs.
        on_record: function called with the record of every run as it ends.
        robot: name or file of a robot instead of HyQ; start, goal and bounds are those for HyQ.

    Raises:
        InvalidInput: sizes or a robot that cannot be used.
    """
    scenario = load_scenario(str(BLOCK))
    variants = [(float(count), surrounded(scenario, count)) for count in _checked(sizes)]
    return _growth("surfaces", "surfaces", variants, seeds, on_record, robot)


def _growth(
    name: str,
    unit: str,
    variants: Sequence[tuple[float, Scenario]],
    seeds: Sequence[int],
    on_record: Callable[[RunRecord], None],
    robot: str | None,
) -> Growth:
    """Planning times of variants of a scenario, given with their sizes."""
    machine = this_machine()
    data = load_robot_data(variants[0][1].load_robot(robot))
    scenes, reading = [], []
    for _, scenario in variants:
        start = time.thread_time()
        scenes.append(scenario.scene())
        reading.append(time.thread_time() - start)
    records: list[list[RunRecord]] = [[] for _ in variants]
    with threadpool_limits(1):
        # All sizes with one seed, then the next seed: disturbances then affect all sizes alike.
        for seed in seeds:
            for (_, scenario), scene, runs in zip(variants, scenes, records, strict=True):
                runs.append(_run(scenario, data, scene, seed))
                on_record(runs[-1])
    sizes = [
        Size(size, len(scene.surfaces), seconds, tuple(runs))
        for (size, _), scene, seconds, runs in zip(variants, scenes, reading, records, strict=True)
    ]
    return Growth(name, unit, machine, tuple(sizes))


def _run(scenario: Scenario, data: RobotData, scene: Scene, seed: int) -> RunRecord:
    request = scenario.request
    task = Task(scenario.name, None, seed, request.robustness_threshold, request.time_limit)
    return measure(scenario, data, scene, task)


def _checked(sizes: Sequence[int]) -> Sequence[int]:
    if len(sizes) < 2 or min(sizes) < 1:
        raise InvalidInput("sizes", list(sizes), "at least two positive sizes are needed")
    return sizes
