"""Time limit, cancel and progress."""

from __future__ import annotations

import math
from types import SimpleNamespace

import pytest

from rbprm_core import budget as budget_module
from rbprm_core.budget import Budget, Progress
from rbprm_core.errors import Cancelled, ErrorCode, InvalidInput, TimeLimitReached


@pytest.mark.parametrize("limit", [0.0, -1.0, -math.inf, math.nan])
def test_a_limit_must_be_positive(limit: float) -> None:
    with pytest.raises(InvalidInput, match="positive") as caught:
        Budget(limit)
    assert caught.value.field == "time_limit"


def test_no_limit_by_default() -> None:
    budget = Budget()
    budget.check("guide")
    assert budget.time_limit == math.inf


def test_the_clock_runs_from_the_start(monkeypatch: pytest.MonkeyPatch) -> None:
    now = 7.0
    monkeypatch.setattr(budget_module, "time", SimpleNamespace(monotonic=lambda: now))
    budget = Budget(0.05)
    now += 0.04
    budget.check("guide")
    now += 0.02
    assert budget.elapsed == pytest.approx(0.06)
    with pytest.raises(TimeLimitReached, match=r"0\.05 s reached in stage sequence") as caught:
        budget.check("sequence")
    assert caught.value.code is ErrorCode.TIME_LIMIT
    assert (caught.value.limit, caught.value.stage) == (0.05, "sequence")


def test_the_caller_is_asked_at_every_check() -> None:
    answers = iter([False, False, True])
    budget = Budget(cancelled=lambda: next(answers))
    budget.check("guide")
    budget.check("guide")
    with pytest.raises(Cancelled) as caught:
        budget.check("shortcut")
    assert caught.value.stage == "shortcut"
    assert caught.value.code is ErrorCode.CANCELLED


def test_progress_is_told_before_the_work_stops() -> None:
    told: list[Progress] = []
    budget = Budget(cancelled=lambda: len(told) == 2, report=told.append)
    budget.check("guide", 0.25)
    with pytest.raises(Cancelled):
        budget.check("sequence", 0.5, states=7)
    assert [(p.stage, p.fraction, p.states) for p in told] == [
        ("guide", 0.25, 0),
        ("sequence", 0.5, 7),
    ]
    assert 0 <= told[0].elapsed <= told[1].elapsed


def test_a_poll_stops_in_the_stage_told_last_and_tells_nothing() -> None:
    told: list[Progress] = []
    stop = False
    budget = Budget(cancelled=lambda: stop, report=told.append)
    budget.check("guide", 0.5)
    budget.poll()
    stop = True
    with pytest.raises(Cancelled) as caught:
        budget.poll()
    assert caught.value.stage == "guide"
    assert len(told) == 1
