"""Figures of a case from its runs."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from rbprm_core.bench.record import INVALID_PLAN, RunFailure, RunRecord
from rbprm_core.counters import CONTACTS_FOUND, ROOTS, ROOTS_IN_EQUILIBRIUM, no_contact
from rbprm_core.failures import CONTACT_CAUSES, Cause

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
class FailureGroup:
    """Runs that failed in the same way.

    Attributes:
        failure: failure of the first of these runs.
        runs: number of these runs.
        seed: seed of the first of these runs.
    """

    failure: RunFailure
    runs: int
    seed: int


@dataclass(frozen=True)
class Aggregate:
    """The figures of a case; those of time and size are of its successes, None without any.

    Attributes:
        scenario: name of the scenario.
        robot: name of the robot.
        robustness: required raw b0 of every state, newtons.
        time_limit: time limit of a run, seconds.
        runs: number of runs.
        successes: number of runs that succeeded.
        seconds: seconds by stage, as in `RunRecord.seconds`.
        guide: seconds of the guide, shortcuts included.
        total: seconds of all stages.
        wall: seconds by the clock.
        cpu: seconds of processor time.
        per_transition: seconds of `total` divided by the number of contact transitions.
        per_state: seconds of `total` divided by the number of states.
        states: number of states.
        transitions: number of contact transitions.
        roots_in_equilibrium: share of the root configurations tried along the guides at which a
            state in equilibrium was found, failed runs included; None where none was tried.
        contacts_found: share of the requested contacts of single limbs that were found, failed
            runs included.
        kinematic_failures: share of those for which no candidate was in reach and free of
            collision.
        equilibrium_failures: share of those for which no candidate was in equilibrium.
        causes: groups of failed runs, the largest first.
        invalid_plans: number of plans that the check refused.
        violations: number of violations that the check found in all plans.
        distinct_plans: number of different plans among the successes.
        support: shares of the transitions in which the robot is in equilibrium without the moving
            contact at both ends, at one, at neither; None where there is no transition.
        overhanging: number of contacts whose patch lies only in part on the environment.
        goal_missed: number of plans whose last state lacks a requested contact.
        peak_memory: largest resident memory of all runs, bytes.
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
    causes: tuple[FailureGroup, ...]
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
    no_equilibrium = counts[no_contact(Cause.NO_EQUILIBRIUM)]
    none = sum(counts[no_contact(cause)] for cause in CONTACT_CAUSES)
    requested = counts[CONTACTS_FOUND] + none
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
        roots_in_equilibrium=_share(counts[ROOTS_IN_EQUILIBRIUM], counts[ROOTS]),
        contacts_found=_share(requested - none, requested),
        kinematic_failures=_share(none - no_equilibrium, requested),
        equilibrium_failures=_share(no_equilibrium, requested),
        causes=_causes(runs),
        invalid_plans=sum(r.failure is not None and r.failure.code == INVALID_PLAN for r in runs),
        violations=sum(sum((run.violations or {}).values()) for run in runs),
        distinct_plans=len({run.digest for run in done}),
        support=_support(done),
        overhanging=sum(run.overhanging for run in runs),
        goal_missed=sum(bool(run.goal_missing) for run in runs),
        peak_memory=max(run.peak_memory for run in runs),
    )


def _causes(runs: list[RunRecord]) -> tuple[FailureGroup, ...]:
    groups: dict[tuple[str, str, str], list[RunRecord]] = {}
    for run in runs:
        if run.failure is not None:
            key = run.failure.code, run.failure.cause, run.failure.limb
            groups.setdefault(key, []).append(run)
    causes = [
        FailureGroup(failed[0].failure, len(failed), failed[0].seed)
        for failed in groups.values()
        if failed[0].failure is not None
    ]
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
