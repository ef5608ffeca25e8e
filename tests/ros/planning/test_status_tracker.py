"""Events and the statuses that follow from them, without processes."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from rbprm_core.errors import ErrorCode
from rbprm_core.failures import Cause, Failure
from rbprm_core.replanning import InvalidState
from rbprm_ros.environment.snapshot import Snapshot
from rbprm_ros.errors import NO_ERROR, ErrorData
from rbprm_ros.planning.sequence import PublishedSequence
from rbprm_ros.planning.status import Activity, Validity
from rbprm_ros.planning.status_tracker import StatusTracker

ERROR = ErrorData(ErrorCode.NO_GUIDE, "no way")
LOST = (InvalidState(5, Failure.of(Cause.SURFACE_LOST, "lf_leg", surface="tile")),)
STATES = 10


def job(**fields: Any) -> Any:
    """A job with the attributes that the tracker reads."""
    return SimpleNamespace(snapshot=Snapshot(1, 100), measured=False, kept=(), **fields)


def sequence(revision: int = 0, first_changed: int = 0) -> PublishedSequence:
    """A sequence of ten states."""
    plan: Any = SimpleNamespace(states=tuple(range(STATES)))
    return PublishedSequence("walk", revision, first_changed, plan, job(), 0, 0)


class Tracked:
    """A tracker of an active node, and the activities that it reported."""

    def __init__(self) -> None:
        self.activities: list[Activity] = []
        self.tracker = StatusTracker(lambda: self.activities.append(self.tracker.status.activity))
        self.tracker.activate(0)

    def publish(self) -> None:
        """Publish a sequence that is valid."""
        self.tracker.begin_call()
        self.tracker.publish(sequence(), Validity.PLANNED, -1, planning=False)
        self.tracker.record_validation(Validity.VALID)


@pytest.fixture
def tracked() -> Tracked:
    return Tracked()


@pytest.fixture
def published() -> Tracked:
    made = Tracked()
    made.publish()
    return made


def test_a_plan_is_planned_then_valid(tracked: Tracked) -> None:
    tracked.publish()
    assert tracked.activities == [Activity.PLANNING, Activity.PLANNING, Activity.VALID]
    status = tracked.tracker.status
    assert (status.environment_version, status.surfaces_stamp) == (1, 100)


def test_events_without_effect_are_not_reported(published: Tracked) -> None:
    count = len(published.activities)
    published.tracker.record_validation(Validity.VALID, (), Snapshot(1, 100))
    published.tracker.record_execution("walk", 0, -1)
    published.tracker.record_execution("another", 0, 3)
    assert len(published.activities) == count


def test_a_sequence_is_invalidated_replanned_and_valid(published: Tracked) -> None:
    tracker = published.tracker
    published.activities.clear()
    tracker.record_validation(Validity.INVALID, LOST, Snapshot(2, 200))
    assert tracker.status.invalid == LOST
    tracker.begin_replanning()
    tracker.end_replanning()
    tracker.publish(sequence(1, 4), Validity.REPLANNED, 2)
    assert tracker.status.invalid == ()
    tracker.record_validation(Validity.VALID)
    assert published.activities == [
        Activity.INVALIDATED,
        Activity.REPLANNING,
        Activity.REPLANNING,
        Activity.VALID,
    ]


def test_news_of_the_sequence_replace_planning_until_the_next_call(published: Tracked) -> None:
    tracker = published.tracker
    tracker.begin_call()
    tracker.record_validation(Validity.VALID, (), Snapshot(2, 200))
    assert tracker.status.activity is Activity.PLANNING
    tracker.record_validation(Validity.INVALID, LOST, Snapshot(3, 300))
    assert tracker.status.activity is Activity.INVALIDATED
    tracker.begin_call()
    assert (tracker.status.activity, tracker.status.invalid) == (Activity.PLANNING, LOST)
    tracker.end_call(others=True)
    assert tracker.status.activity is Activity.PLANNING
    tracker.end_call(others=False)
    assert tracker.status.activity is Activity.INVALIDATED


def test_a_call_that_fails_without_a_sequence(tracked: Tracked) -> None:
    tracked.tracker.begin_call()
    tracked.tracker.end_call(False, ERROR)
    assert (tracked.tracker.status.activity, tracked.tracker.status.error) == (
        Activity.FAILED,
        ERROR,
    )
    tracked.tracker.begin_call()
    assert tracked.tracker.status.error == NO_ERROR


def test_a_call_that_fails_leaves_the_sequence_valid(published: Tracked) -> None:
    tracker = published.tracker
    tracker.begin_call()
    tracker.end_call(False, ERROR)
    assert (tracker.status.activity, tracker.status.error) == (Activity.VALID, ERROR)
    tracker.record_validation(Validity.VALID, (), Snapshot(2, 200))
    assert tracker.status.error == NO_ERROR


def test_a_node_that_is_not_active_is_idle(published: Tracked) -> None:
    tracker = published.tracker
    tracker.record_validation(Validity.INVALID, LOST, Snapshot(2, 200))
    tracker.deactivate()
    assert (tracker.status.activity, tracker.status.invalid) == (Activity.IDLE, LOST)
    tracker.activate(2)  # the environment that it was validated against
    assert tracker.status.activity is Activity.INVALIDATED
    tracker.deactivate()
    tracker.activate(3)
    assert tracker.status.activity is Activity.IDLE


@pytest.mark.parametrize(
    ("revision", "state", "executed"),
    [(1, 7, 7), (1, 99, STATES - 1), (0, 7, 3), (0, 2, 2), (2, 7, -1), (1, -1, -1)],
)
def test_executed_state(tracked: Tracked, revision: int, state: int, executed: int) -> None:
    """For the revision before, those states count that the published one has too."""
    tracked.tracker.publish(sequence(1, 4), Validity.PLANNED, -1)
    tracked.tracker.record_execution("walk", revision, state)
    assert tracked.tracker.executed == executed
    tracked.tracker.record_execution("walk", 1, 1)
    assert tracked.tracker.executed == max(executed, 1)


def test_why_a_replan_is_outdated(published: Tracked) -> None:
    tracker, base = published.tracker, published.tracker.published
    assert base is not None
    work = job()
    work.kept = (0, 1, 2, 3)
    tracker.record_execution("walk", 0, 2)
    assert tracker.why_outdated(work, base, (0, 1, 2, 3, 20)) == ""  # type: ignore[arg-type]
    tracker.record_execution("walk", 0, 4)
    text = tracker.why_outdated(work, base, (0, 1, 2, 3, 20))  # type: ignore[arg-type]
    assert "state 4" in text
    work.measured = True
    assert tracker.why_outdated(work, base, (0, 1, 2, 3, 20)) == ""  # type: ignore[arg-type]
    tracker.publish(sequence(1), Validity.PLANNED, -1)
    assert "another revision" in tracker.why_outdated(work, base, ())
