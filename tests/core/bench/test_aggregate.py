"""Figures of a case, compared with figures computed by hand."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from rbprm_core.bench import RunRecord
from rbprm_core.bench.aggregate import Spread, aggregate
from rbprm_core.bench.record import INVALID_PLAN, RunFailure
from rbprm_core.counters import no_contact
from rbprm_core.failures import Cause

MakeRecord = Callable[..., RunRecord]

NO_GUIDE = RunFailure("NO_GUIDE", "trees_not_connected", "", "no guide")


def test_a_spread_orders_its_figures() -> None:
    rng = np.random.default_rng(0)
    for size in (1, 2, 7, 50):
        values = rng.exponential(size=size)
        spread = Spread.of(values)
        assert spread.minimum <= spread.median <= spread.p95 <= spread.maximum
        assert spread.mean == pytest.approx(values.sum() / size)
        assert {spread.minimum, spread.maximum} <= set(values.tolist())


def test_times_are_of_the_successes_only(make_record: MakeRecord) -> None:
    slow = {"prepare": 0, "guide": 9.0, "shortcut": 0, "sequence": 0, "total": 9.0}
    runs = [make_record(), make_record(seed=1, seconds=slow, failure=NO_GUIDE)]
    (case,) = aggregate(runs)
    assert (case.runs, case.successes, case.success) == (2, 1, 0.5)
    assert case.total is not None
    assert case.total.maximum == 1.0
    assert case.guide is not None
    assert case.guide.mean == pytest.approx(0.3)  # with its shortcuts
    assert case.per_transition is not None
    assert case.per_transition.mean == pytest.approx(0.25)
    assert case.per_state is not None
    assert case.per_state.mean == pytest.approx(0.1)


def test_shares_count_failed_runs_too(make_record: MakeRecord) -> None:
    good = {"roots": 40, "roots_in_equilibrium": 39, "contacts": 30}
    bad = {
        "roots": 10, "roots_in_equilibrium": 1, "contacts": 2, no_contact(Cause.NO_EQUILIBRIUM): 6,
        no_contact(Cause.NO_KINEMATIC_SOLUTION): 1, no_contact(Cause.NO_CANDIDATE): 1,
    }  # fmt: skip
    failure = RunFailure("NO_SEQUENCE", "no_equilibrium", "lf_leg", "")
    (case,) = aggregate([make_record(counts=good), make_record(counts=bad, failure=failure)])
    assert case.roots_in_equilibrium == pytest.approx(40 / 50)
    assert case.contacts_found == pytest.approx(32 / 40)
    assert case.kinematic_failures == pytest.approx(2 / 40)
    assert case.equilibrium_failures == pytest.approx(6 / 40)


def test_failures_that_differ_in_text_only_are_one_group(make_record: MakeRecord) -> None:
    failures = [
        RunFailure("NO_SEQUENCE", "low_robustness", "lf_leg", "robustness 3.2 N under 10 N"),
        RunFailure("NO_SEQUENCE", "low_robustness", "lf_leg", "robustness -inf N under 10 N"),
        RunFailure("NO_SEQUENCE", "low_robustness", "rf_leg", "robustness 3.2 N under 10 N"),
        RunFailure("NO_SEQUENCE", "low_robustness", "lf_leg", "robustness 3.2 N under 10 N"),
        RunFailure("NO_SEQUENCE", "no_candidate", "lf_leg", "robustness 3.2 N under 10 N"),
        RunFailure("TIME_LIMIT", "low_robustness", "lf_leg", "robustness 3.2 N under 10 N"),
    ]
    runs = [make_record(seed=seed, failure=failure) for seed, failure in enumerate(failures)]
    groups = aggregate(runs)[0].causes
    assert [(group.runs, group.seed) for group in groups] == [(3, 0), (1, 2), (1, 4), (1, 5)]
    assert [group.failure for group in groups] == [failures[k] for k in (0, 2, 4, 5)]


def test_without_a_success_there_are_no_times(make_record: MakeRecord) -> None:
    failure = RunFailure(INVALID_PLAN, "drift", "", "state 3: drift")
    (case,) = aggregate([make_record(failure=failure, violations={"drift": 2, "goal": 1})])
    assert case.total is None
    assert case.seconds == {}
    assert case.support is None
    assert (case.invalid_plans, case.violations) == (1, 3)


def test_cases_are_apart_by_robustness_and_keep_their_order(make_record: MakeRecord) -> None:
    runs = [make_record(robustness=b0, seed=s) for s in (0, 1) for b0 in (20.0, 10.0)]
    assert [(case.robustness, case.runs) for case in aggregate(runs)] == [(20.0, 2), (10.0, 2)]


def test_transitions_are_weighed_not_plans(make_record: MakeRecord) -> None:
    runs = [make_record(support=(8, 0, 0)), make_record(support=(0, 1, 1))]
    assert aggregate(runs)[0].support == pytest.approx((0.8, 0.1, 0.1))
