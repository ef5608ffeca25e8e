"""A campaign: cases times seeds, one task each, over processes or machines."""

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

FORMAT: Literal["rbprm-campaign/1"] = "rbprm-campaign/1"
Identity = tuple[CaseKey, int]  # the case and the seed


@dataclass(frozen=True)
class Campaign:
    """What a campaign gave.

    Attributes:
        machine: that it was started on.
        backend: of joblib. jobs: runs at once, as asked for.
        asked: number of runs asked for.
        records: the runs that ended, by case and seed.
        stopped: why the others did not; "" where all ended.
    """

    machine: Machine
    backend: str
    jobs: int
    asked: int
    records: tuple[RunRecord, ...]
    stopped: str = ""
    format: Literal["rbprm-campaign/1"] = FORMAT

    @property
    def aggregates(self) -> tuple[Aggregate, ...]:
        """The figures of each case, in the order of the records."""
        return aggregate(self.records)

    def content(self) -> dict[str, Any]:
        """The campaign and its figures, as JSON can hold them."""
        content: dict[str, Any] = TypeAdapter(Campaign).dump_python(self, mode="json")
        figures = TypeAdapter(tuple[Aggregate, ...]).dump_python(self.aggregates, mode="json")
        return {**content, "aggregates": figures}

    @staticmethod
    def read(path: str | Path) -> Campaign:
        """Read a campaign's JSON; the aggregates in it are computed again.

        Raises:
            InvalidInput: absent, not JSON, or not a campaign.
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

    Each run is one task of joblib, so whatever backend joblib knows spreads them. Robot data are
    computed here first, where they are not kept yet; machines with another cache make their own.

    Args:
        jobs: runs at once, -1 for as many as there are cores; more than there are idle cores makes
            the times worthless. A cluster's backend has its own number.
        backend: a name that joblib knows. backend_options: arguments of that backend.
        on_record: told every run as it ends, those done before at once.
        on_robot_data: told the share done.
        before: a campaign that was stopped; what it did is taken as done, and its other runs are
            kept beside.

    Returns:
        What ended until the last run, an interrupt (Ctrl-C), or the loss of a worker.

    Raises:
        InvalidInput: a case that cannot be run, no seeds, an unknown backend, or a campaign before
            that is of other versions or another machine.
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
    except Exception as error:  # a lost worker or cluster must not take with it what is there
        if not found:
            raise
        stopped = f"{type(error).__name__}: {error}"
    records = (*done.values(), *(found[i] for i in sorted(found)))
    return Campaign(machine, backend, jobs, len(done) + len(tasks), records, stopped)


def _tasks(
    cases: Sequence[Case], seeds: Sequence[int], report: Callable[[float], None]
) -> dict[Task, Identity]:
    """Every case with every seed; what cannot be used is refused here, before anything runs."""
    if not cases:
        raise InvalidInput("scenarios", [], "at least one is needed")
    if not seeds or min(seeds) < 0:
        raise InvalidInput("seeds", list(seeds), "at least one is needed, none negative")
    tasks: dict[Task, Identity] = {}
    for case in cases:
        text = load_scenario(case.scenario)
        robot = text.load_robot(case.robot)
        own = text.request_text(robot.name).time_limit
        limit = own if case.time_limit is None else case.time_limit
        limit = finite_number("time_limit", limit, low=MIN_TIME_LIMIT)
        robustness = text.request_for(robot, 0, case.robustness).robustness_threshold
        text.scene()
        load_robot_data(robot, report)
        scenario = _portable(case.scenario, known_scenarios())
        chosen = None if case.robot is None else _portable(case.robot, known_robots())
        files = (text.model_dump_json(), robot.description.model_dump_json())
        inputs = key_of(file.encode() for file in files)
        for seed in seeds:
            task = Task(scenario, chosen, seed, robustness, limit, inputs)
            tasks[task] = (text.name, robot.name, inputs, robustness, limit), seed
    return tasks


def _done_before(before: Campaign | None, machine: Machine) -> dict[Identity, RunRecord]:
    """The runs that a campaign before has done."""
    if before is None:
        return {}
    if replace(before.machine, date=machine.date) != machine:
        reason = "cannot be resumed: it is of other versions or of another machine"
        raise InvalidInput("campaign", before.machine.date, reason)
    return {(case_key(run), run.seed): run for run in before.records}


def _portable(name: str, known: Container[str]) -> str:
    """A known name as it is, a file by its absolute path."""
    return name if name in known else str(Path(name).absolute())


@contextmanager
def _configured(backend: str, jobs: int, options: dict[str, Any]) -> Iterator[None]:
    try:
        configured = parallel_config(backend=backend, n_jobs=jobs, **options)
    except (ValueError, TypeError) as error:  # what joblib raises of an unknown name or option
        raise InvalidInput("backend", backend, str(error)) from error
    with configured:
        yield


def _results(tasks: dict[int, Task]) -> Iterator[tuple[int, RunRecord]]:
    """Index and record of each task, as they end."""
    parallel = Parallel(return_as="generator_unordered", batch_size=1)
    results = parallel(delayed(_run)(i, task) for i, task in tasks.items())
    yield from results


def _run(index: int, task: Task) -> tuple[int, RunRecord]:
    return index, run_task(task)
