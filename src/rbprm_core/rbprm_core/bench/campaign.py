"""A campaign: one task for each case and seed, distributed over processes or machines."""

from __future__ import annotations

from collections.abc import Callable, Container, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

from joblib import Parallel, delayed, parallel_config
from pydantic import TypeAdapter, ValidationError

from rbprm_core.bench.aggregate import Aggregate, CaseKey, aggregate, case_key
from rbprm_core.bench.machine import Machine, this_machine
from rbprm_core.bench.record import Case, RunRecord, Task
from rbprm_core.bench.run import run_task
from rbprm_core.budget import MIN_TIME_LIMIT
from rbprm_core.cache import key_of
from rbprm_core.errors import InvalidInput
from rbprm_core.robot import known_robots
from rbprm_core.robot.data import load_robot_data
from rbprm_core.scenario import known_scenarios, load_scenario
from rbprm_core.validation import finite_number

FORMAT: Literal["rbprm-campaign/2"] = "rbprm-campaign/2"
Identity = tuple[CaseKey, int]
"""Case and seed of a run."""


@dataclass(frozen=True)
class Campaign:
    """The result of a campaign.

    Attributes:
        machine: machine on which the campaign was started.
        backend: name of joblib's backend.
        jobs: requested number of runs at the same time.
        requested: number of requested runs.
        records: records of the finished runs, by case and seed.
        stopped: reason why the other runs did not finish; "" where all did.
        format: version of the JSON format.
    """

    machine: Machine
    backend: str
    jobs: int
    requested: int
    records: tuple[RunRecord, ...]
    stopped: str = ""
    format: Literal["rbprm-campaign/2"] = FORMAT

    @property
    def aggregates(self) -> tuple[Aggregate, ...]:
        """The figures of each case, in the order of the records."""
        return aggregate(self.records)

    def content(self) -> dict[str, Any]:
        """The campaign and the figures of its cases, as values for JSON."""
        content: dict[str, Any] = TypeAdapter(Campaign).dump_python(self, mode="json")
        figures = TypeAdapter(tuple[Aggregate, ...]).dump_python(self.aggregates, mode="json")
        return {**content, "aggregates": figures}

    @staticmethod
    def read(path: str | Path) -> Campaign:
        """The campaign of a JSON file; the figures of its cases are computed again.

        Args:
            path: path of the file.

        Raises:
            InvalidInput: a missing file, invalid JSON, or other content.
        """
        try:
            return TypeAdapter(Campaign).validate_json(Path(path).read_text())
        except OSError as error:
            reason = f"cannot be read: {error.strerror}"
            raise InvalidInput("campaign", str(path), reason) from error
        except ValidationError as error:
            first = error.errors()[0]
            field = ".".join(str(part) for part in first["loc"]) or "campaign"
            raise InvalidInput(field, first["input"], first["msg"]) from error


def run_campaign(
    cases: Sequence[Case],
    seeds: Sequence[int],
    *,
    jobs: int = 1,
    backend: str = "loky",
    backend_options: dict[str, Any] | None = None,
    on_record: Callable[[RunRecord], None] = lambda record: None,
    on_robot_data: Callable[[float], None] = lambda fraction: None,
    before: Campaign | None = None,
) -> Campaign:
    """Run every case with every seed.

    Each run is one task of joblib, so that every backend of joblib can distribute them. Robot data
    that are not cached yet are computed first; machines with another cache compute their own.

    Args:
        cases: scenarios with robot and bounds.
        seeds: seeds, none negative.
        jobs: number of runs at the same time, -1 for the number of cores. With more runs than idle
            cores, times mean nothing. The backend of a cluster has its own number.
        backend: name of a backend of joblib.
        backend_options: arguments of that backend.
        on_record: function called with the record of every run as it ends, and first with those of
            earlier runs.
        on_robot_data: function called with the share of the robot data that is computed, 0 to 1.
        before: an earlier, stopped campaign; its finished runs are not run again, and its runs of
            other cases are kept.

    Returns:
        The campaign with the runs that finished before its end, an interrupt (Ctrl-C), or the loss
        of a worker.

    Raises:
        InvalidInput: a case that cannot be run, no seeds, an unknown backend, or an earlier
            campaign of other versions or another machine.
    """
    if jobs == 0:
        raise InvalidInput("jobs", jobs, "must be positive, or negative to leave cores idle")
    machine = this_machine()
    tasks = _tasks(cases, seeds, on_robot_data)
    done = _done_before(before, machine)
    found = {i: done.pop(task) for i, task in enumerate(tasks.values()) if task in done}
    for record in found.values():
        on_record(record)
    left = {i: task for i, task in enumerate(tasks) if i not in found}
    stopped = ""
    try:
        with _configured(backend, jobs, backend_options or {}):
            for i, record in _results(left):
                found[i] = record
                on_record(record)
    except KeyboardInterrupt:
        stopped = "interrupted"
    except Exception as error:  # the finished runs must survive the loss of a worker or cluster
        if not found:
            raise
        stopped = f"{type(error).__name__}: {error}"
    records = (*done.values(), *(found[i] for i in sorted(found)))
    return Campaign(machine, backend, jobs, len(done) + len(tasks), records, stopped)


def _tasks(
    cases: Sequence[Case], seeds: Sequence[int], report: Callable[[float], None]
) -> dict[Task, Identity]:
    """Case and seed by task, for every case and seed; invalid ones raise before anything runs."""
    if not cases:
        raise InvalidInput("scenarios", [], "at least one is needed")
    if not seeds or min(seeds) < 0:
        raise InvalidInput("seeds", list(seeds), "at least one is needed, none negative")
    tasks: dict[Task, Identity] = {}
    for case in cases:
        scenario = load_scenario(case.scenario)
        robot = scenario.load_robot(case.robot)
        own = scenario.request_text(robot.name).time_limit
        limit = own if case.time_limit is None else case.time_limit
        limit = finite_number("time_limit", limit, low=MIN_TIME_LIMIT)
        robustness = scenario.request_for(robot, 0, case.robustness).robustness_threshold
        scenario.scene()
        load_robot_data(robot, report)
        name = _portable(case.scenario, known_scenarios())
        chosen = None if case.robot is None else _portable(case.robot, known_robots())
        files = (scenario.model_dump_json(), robot.description.model_dump_json())
        inputs = key_of(file.encode() for file in files)
        for seed in seeds:
            task = Task(name, chosen, seed, robustness, limit, inputs)
            tasks[task] = (scenario.name, robot.name, inputs, robustness, limit), seed
    return tasks


def _done_before(before: Campaign | None, machine: Machine) -> dict[Identity, RunRecord]:
    """Record by case and seed of the runs of an earlier campaign."""
    if before is None:
        return {}
    if replace(before.machine, date=machine.date) != machine:
        reason = "cannot be resumed: its versions or its machine differ from the present ones"
        raise InvalidInput("campaign", before.machine.date, reason)
    return {(case_key(run), run.seed): run for run in before.records}


def _portable(name: str, known: Container[str]) -> str:
    """A known name unchanged, the path of a file made absolute."""
    return name if name in known else str(Path(name).absolute())


@contextmanager
def _configured(backend: str, jobs: int, options: dict[str, Any]) -> Iterator[None]:
    """A context in which joblib uses a backend."""
    try:
        configured = parallel_config(backend=backend, n_jobs=jobs, **options)
    except (ValueError, TypeError) as error:  # joblib's errors for an unknown name or option
        raise InvalidInput("backend", backend, str(error)) from error
    with configured:
        yield


def _results(tasks: dict[int, Task]) -> Iterator[tuple[int, RunRecord]]:
    """Index and record of each task, in the order in which the tasks end."""
    parallel = Parallel(return_as="generator_unordered", batch_size=1)
    results = parallel(delayed(_run)(i, task) for i, task in tasks.items())
    yield from results


def _run(index: int, task: Task) -> tuple[int, RunRecord]:
    return index, run_task(task)
