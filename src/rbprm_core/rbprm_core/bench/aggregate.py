"""Figures of a case from its runs."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from rbprm_core.bench.failure import group
from rbprm_core.bench.record import INVALID_PLAN, Failure, RunRecord

FOUND_CONTACT = "contacts"
NO_EQUILIBRIUM = "no contact: equilibrium"
NO_CONTACT = "no contact: "
CaseKey = tuple[str, str, str, float, float]


@dataclass(frozen=True)
class Spread:
    """Statistics of some values, in the values' unit.

    Attributes:
        minimum: smallest value.
        mean: arithmetic mean.
        median: median.
        p95: 95th percentile.
        maximum: largest value.
    """

    minimum: float
    mean: float
    median: float
    p95: float
    maximum: float

    @staticmethod
    def of(values: Sequence[float]) -> Spread:
        """The statistics of at least one value."""
        array = np.asarray(values, dtype=float)
        return Spread(
            minimum=float(array.min()),
            mean=float(array.mean()),
            median=float(np.median(array)),
            p95=float(np.percentile(array, 95)),
            maximum=float(array.max()),
        )


@dataclass(frozen=True)
class Cause:
    """A way to fail: how many runs, and the seed of one of them."""

    failure: Failure
    runs: int
    seed: int


@dataclass(frozen=True)
class Aggregate:
    """The figures of a case; those of time and size are of its successes, None without any.

    Attributes:
        seconds: by phase, as `RunRecord.seconds`. guide: with its shortcuts. total: all phases.
        wall, cpu: seconds by the clock, and of processor time.
        per_transition, per_state: seconds of `total` for one.
        states, transitions: numbers.
        roots_in_equilibrium: share of the root configurations tried along the guides that gave a
            state in equilibrium, failed runs included; None where none was tried.
        contacts_found: share of the contacts asked of single limbs that were found, failed runs
            included; the others are kinematic_failures, where no candidate was in reach and free of
            collision, and equilibrium_failures, where none was in equilibrium.
        causes: of the failures, the most frequent first.
        invalid_plans, violations: plans that the check refused, and broken bounds in all.
        distinct_plans: number of different plans among the successes.
        support: shares of their transitions in which the robot stands without the moving contact at
            both ends, at one, at neither; None where there is no transition.
        overhanging: contacts of all plans whose patch lies only in part on the environment.
        goal_missed: plans whose last state lacks a contact that was asked for.
        peak_memory: bytes, the most of all runs.
    """

    scenario: str
    robot: str
    robustness: float
    time_limit: float
    runs: int
    successes: int
    seconds: dict[str, Spread]
    guide: Spread | None
    total: Spread | None
    wall: Spread | None
    cpu: Spread | None
    per_transition: Spread | None
    per_state: Spread | None
    states: Spread | None
    transitions: Spread | None
    roots_in_equilibrium: float | None
    contacts_found: float | None
    kinematic_failures: float | None
    equilibrium_failures: float | None
    causes: tuple[Cause, ...]
    invalid_plans: int
    violations: int
    distinct_plans: int
    support: tuple[float, float, float] | None
    overhanging: int
    goal_missed: int
    peak_memory: int

    @property
    def success(self) -> float:
        """Share of the runs that succeeded."""
        return self.successes / self.runs


def aggregate(records: Iterable[RunRecord]) -> tuple[Aggregate, ...]:
    """The figures of each case (scenario, robot, robustness, limit), in the records' order."""
    cases: dict[CaseKey, list[RunRecord]] = {}
    for record in records:
        cases.setdefault(case_key(record), []).append(record)
    return tuple(_of_case(runs) for runs in cases.values())


def case_key(record: RunRecord) -> CaseKey:
    """What the runs of a case share: names of scenario and robot, what their files say, bounds."""
    return record.scenario, record.robot, record.inputs, record.robustness, record.time_limit


def _of_case(runs: list[RunRecord]) -> Aggregate:
    done = [run for run in runs if run.success]
    phases = dict.fromkeys(phase for run in done for phase in run.seconds)
    counts: Counter[str] = Counter()
    for run in runs:
        counts.update(run.counts)
    no_equilibrium = counts[NO_EQUILIBRIUM]
    none = sum(n for name, n in counts.items() if name.startswith(NO_CONTACT))
    asked = counts[FOUND_CONTACT] + none
    return Aggregate(
        scenario=runs[0].scenario,
        robot=runs[0].robot,
        robustness=runs[0].robustness,
        time_limit=runs[0].time_limit,
        runs=len(runs),
        successes=len(done),
        seconds={k: Spread.of([run.seconds.get(k, 0.0) for run in done]) for k in phases},
        guide=_spread([run.seconds["guide"] + run.seconds["shortcut"] for run in done]),
        total=_spread([_total(run) for run in done]),
        wall=_spread([run.wall for run in done]),
        cpu=_spread([run.cpu for run in done]),
        per_transition=_spread([_total(run) / max(run.transitions, 1) for run in done]),
        per_state=_spread([_total(run) / max(run.states, 1) for run in done]),
        states=_spread([run.states for run in done]),
        transitions=_spread([run.transitions for run in done]),
        roots_in_equilibrium=_share(counts["roots_in_equilibrium"], counts["roots"]),
        contacts_found=_share(asked - none, asked),
        kinematic_failures=_share(none - no_equilibrium, asked),
        equilibrium_failures=_share(no_equilibrium, asked),
        causes=_causes(runs),
        invalid_plans=sum(r.failure is not None and r.failure.code == INVALID_PLAN for r in runs),
        violations=sum(sum((run.violations or {}).values()) for run in runs),
        distinct_plans=len({run.digest for run in done}),
        support=_support(done),
        overhanging=sum(run.overhanging for run in runs),
        goal_missed=sum(bool(run.goal_missing) for run in runs),
        peak_memory=max(run.peak_memory for run in runs),
    )


def _causes(runs: list[RunRecord]) -> tuple[Cause, ...]:
    grouped: dict[Failure, list[int]] = {}
    for run in runs:
        if run.failure is not None:
            grouped.setdefault(group(run.failure), []).append(run.seed)
    causes = [Cause(failure, len(seeds), seeds[0]) for failure, seeds in grouped.items()]
    return tuple(sorted(causes, key=lambda cause: -cause.runs))


def _support(done: list[RunRecord]) -> tuple[float, float, float] | None:
    counts = np.sum([run.support or (0, 0, 0) for run in done], axis=0)
    if not counts.any():
        return None
    both, one, neither = (counts / counts.sum()).tolist()
    return both, one, neither


def _total(run: RunRecord) -> float:
    return run.seconds["total"]


def _spread(values: Sequence[float]) -> Spread | None:
    return Spread.of(values) if values else None


def _share(part: int, whole: int) -> float | None:
    return part / whole if whole else None
