"""Campaigns with real runs: in this process, in several processes, on a Dask cluster."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from distributed import Client, LocalCluster
from threadpoolctl import threadpool_info

from rbprm_core.bench import Campaign, Case, RunRecord, campaign, run, run_campaign
from rbprm_core.bench.record import INVALID_PLAN, RunFailure, Task
from rbprm_core.budget import MIN_TIME_LIMIT
from rbprm_core.check import Kind
from rbprm_core.errors import InvalidInput, TimeLimitReached
from rbprm_core.outcome import Outcome
from rbprm_core.plan_record import Statistics

SEEDS = range(2)


@pytest.fixture(scope="module")
def alone(stroll: str, quick_hyq: str) -> Campaign:
    """HyQ over 60 cm of flat ground, in this process."""
    return run_campaign([Case(stroll, quick_hyq)], SEEDS)


@pytest.fixture
def cluster() -> Iterator[Client]:
    """Two Dask workers, each a process of one thread."""
    local = LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None)
    with local, Client(local) as client:
        yield client


def digests(found: Campaign) -> list[tuple[int, str]]:
    return [(record.seed, record.digest) for record in found.records]


def processes(found: Campaign) -> set[str]:
    return {record.process for record in found.records}


def test_a_run_says_what_it_took_and_gave(alone: Campaign) -> None:
    assert (alone.requested, alone.stopped) == (2, "")
    assert [record.seed for record in alone.records] == list(SEEDS)
    for record in alone.records:
        assert record.success
        assert (record.scenario, record.robot, record.time_limit) == ("flat", "hyq", 30.0)
        assert record.violations == {}
        assert record.min_robustness is not None
        assert record.min_robustness >= record.robustness == 10.0
        phases = [record.seconds[name] for name in ("prepare", "guide", "shortcut", "sequence")]
        assert sum(phases) == pytest.approx(record.seconds["total"])
        assert record.seconds["total"] <= record.wall
        assert record.cpu > 0
        assert 0 < record.transitions < record.states == record.counts["states"]
        assert record.guide_length == pytest.approx(0.6, abs=0.1)
        assert 0 < record.counts["roots_in_equilibrium"] <= record.counts["roots"]
        assert sum(record.support or ()) == record.transitions
        assert 5e7 < record.peak_memory < 2e9


def test_processes_give_the_same_plans(alone: Campaign, stroll: str, quick_hyq: str) -> None:
    found = run_campaign([Case(stroll, quick_hyq)], SEEDS, jobs=2)
    assert digests(found) == digests(alone)
    assert not processes(found) & processes(alone)


def test_a_dask_cluster_gives_the_same_plans(cluster: Client, quick_hyq: str) -> None:
    seen: list[RunRecord] = []
    cases = [Case("flat", quick_hyq)]
    alone = run_campaign(cases, SEEDS)
    found = run_campaign(cases, SEEDS, backend="dask", on_record=seen.append)
    assert digests(found) == digests(alone)
    assert len(processes(found)) == 2
    assert not processes(found) & processes(alone)
    assert sorted(record.seed for record in seen) == list(SEEDS)


def test_an_interrupt_keeps_what_is_done(stroll: str, quick_hyq: str) -> None:
    def interrupt(record: RunRecord) -> None:
        raise KeyboardInterrupt

    found = run_campaign([Case(stroll, quick_hyq)], range(5), on_record=interrupt)
    assert (len(found.records), found.requested, found.stopped) == (1, 5, "interrupted")


def test_a_stopped_campaign_goes_on(alone: Campaign, stroll: str, quick_hyq: str) -> None:
    first = replace(alone, records=alone.records[:1], stopped="interrupted")
    seen: list[RunRecord] = []
    found = run_campaign([Case(stroll, quick_hyq)], SEEDS, before=first, on_record=seen.append)
    assert found.records[0] is alone.records[0]
    assert digests(found) == digests(alone)
    assert seen == list(found.records)


def test_a_campaign_of_other_versions_does_not_go_on(
    alone: Campaign, stroll: str, quick_hyq: str
) -> None:
    machine = replace(alone.machine, versions=alone.machine.versions | {"pin": "0.1"})
    with pytest.raises(InvalidInput) as caught:
        run_campaign([Case(stroll, quick_hyq)], SEEDS, before=replace(alone, machine=machine))
    assert caught.value.field == "campaign"


def test_a_lost_worker_keeps_what_is_done(
    stroll: str, quick_hyq: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = campaign.run_task

    def die_at_last(task: Task) -> RunRecord:
        if task.seed == 1:
            raise MemoryError("gone")
        return real(task)

    monkeypatch.setattr(campaign, "run_task", die_at_last)
    found = run_campaign([Case(stroll, quick_hyq)], range(2))
    assert [record.seed for record in found.records] == [0]
    assert found.stopped == "MemoryError: gone"


def test_threshold_and_time_limit_of_a_case_are_used(stroll: str, quick_hyq: str) -> None:
    cases = [
        Case(stroll, quick_hyq, robustness=0.0, time_limit=20.0),
        Case(stroll, quick_hyq, time_limit=MIN_TIME_LIMIT),
    ]
    first, second = run_campaign(cases, [4]).records
    assert (first.robustness, first.time_limit, first.seed) == (0.0, 20.0, 4)
    assert first.success
    assert second.failure is not None
    assert second.failure.code == "TIME_LIMIT"
    assert second.seconds["prepare"] > 0  # times are recorded for a failure, too
    assert second.violations is None


def test_a_run_is_in_one_thread(
    stroll: str, quick_hyq: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    threads: list[int] = []

    def look(*_: object) -> None:
        threads.extend(pool["num_threads"] for pool in threadpool_info())
        raise TimeLimitReached(1.0, "start")

    monkeypatch.setattr(run, "plan", look)
    record = run.run_task(Task(stroll, quick_hyq, 0, 10.0, 1.0))
    assert record.failure is not None
    assert threads
    assert set(threads) == {1}


def test_a_plan_that_breaks_a_bound_is_no_success(
    stroll: str, quick_hyq: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = run.plan

    def stop_short(*arguments: Any) -> Outcome:
        outcome = real(*arguments)
        return replace(outcome, states=outcome.states[:-3])

    monkeypatch.setattr(run, "plan", stop_short)
    record = run.run_task(Task(stroll, quick_hyq, 0, 10.0, 30.0))
    assert record.violations == {Kind.GOAL: 1}
    assert record.failure is not None
    assert (record.failure.code, record.failure.cause) == (INVALID_PLAN, "goal")


def test_a_fault_of_the_planner_is_a_failed_run(
    stroll: str, quick_hyq: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise ZeroDivisionError("oh")

    monkeypatch.setattr(run, "plan", fail)
    record = run.run_task(Task(stroll, quick_hyq, 0, 10.0, 30.0))
    assert record.failure is not None
    assert record.failure == RunFailure(
        "INTERNAL", "ZeroDivisionError", "", "ZeroDivisionError: oh"
    )
    assert record.seconds == Statistics().time


@pytest.mark.parametrize(
    ("cases", "seeds", "options", "field"),
    [
        ([], SEEDS, {}, "scenarios"),
        ([Case("flat")], [], {}, "seeds"),
        ([Case("flat")], [-1], {}, "seeds"),
        ([Case("nowhere")], SEEDS, {}, "scenario"),
        ([Case("flat", "unicorn")], SEEDS, {}, "robot"),
        ([Case("flat", robustness=-1.0)], SEEDS, {}, "robustness_threshold"),
        ([Case("flat", time_limit=0.0)], SEEDS, {}, "time_limit"),
        ([Case("flat")], SEEDS, {"jobs": 0}, "jobs"),
    ],
)
def test_what_cannot_be_run_is_refused(
    cases: list[Case], seeds: Sequence[int], options: dict[str, Any], field: str
) -> None:
    with pytest.raises(InvalidInput) as caught:
        run_campaign(cases, seeds, **options)
    assert caught.value.field == field


@pytest.mark.parametrize("backend", ["telepathy", "dask"])  # no cluster is running
def test_a_backend_that_is_not_there(stroll: str, quick_hyq: str, backend: str) -> None:
    with pytest.raises(InvalidInput) as caught:
        run_campaign([Case(stroll, quick_hyq)], SEEDS, backend=backend)
    assert (caught.value.field, caught.value.value) == ("backend", backend)


def test_files_are_sent_by_their_absolute_path(
    stroll: str, quick_hyq: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sent: list[Task] = []

    def keep(task: Task) -> RunRecord:
        sent.append(task)
        raise KeyboardInterrupt

    (tmp_path / "hyq.toml").write_text(Path(quick_hyq).read_text())
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(campaign, "run_task", keep)
    run_campaign([Case("flat", "hyq.toml")], [0])
    (task,) = sent
    assert (task.scenario, task.robot) == ("flat", str(tmp_path / "hyq.toml"))


def test_an_edited_scenario_is_run_anew_and_kept_apart(
    alone: Campaign, stroll: str, quick_hyq: str, tmp_path: Path
) -> None:
    """Scenarios of one name with different content are different cases."""
    edited = tmp_path / "flat.toml"
    text = Path(stroll).read_text()
    edited.write_text(text.replace("[-1.4, 0.0, 0.6]", "[-1.5, 0.0, 0.6]"))
    assert edited.read_text() != text
    found = run_campaign([Case(str(edited), quick_hyq)], [0], before=alone)
    assert digests(found)[:2] == digests(alone)
    assert [record.seed for record in found.records] == [*SEEDS, 0]
    assert len(found.aggregates) == 2
