"""The planner's status as a table over facts."""

from __future__ import annotations

import enum
from dataclasses import dataclass, field
from enum import IntEnum

from rbprm_core.errors import ErrorCode
from rbprm_core.replanning import InvalidState
from rbprm_ros.errors import NO_ERROR, ErrorData


class Activity(IntEnum):
    """What the planner does; the states of the message PlannerStatus, with their values."""

    IDLE = 0
    PLANNING = 1
    VALID = 2
    INVALIDATED = 3
    REPLANNING = 4
    FAILED = 5


class Validity(enum.Enum):
    """Last validation result of the published sequence.

    Attributes:
        PLANNED: none yet; the sequence is the newest result of a call.
        REPLANNED: none yet; the revision was replanned automatically.
        UNKNOWN: none; the surfaces changed while the node was not active.
        VALID: all states that are not executed yet are valid.
        INVALID: a state that is not executed yet is invalid.
        FAILED: replanning failed, the robot is in an invalid state, or validation itself failed.
    """

    PLANNED = enum.auto()
    REPLANNED = enum.auto()
    UNKNOWN = enum.auto()
    VALID = enum.auto()
    INVALID = enum.auto()
    FAILED = enum.auto()


@dataclass(frozen=True)
class Facts:
    """The facts that decide the planner's activity and the error in its status.

    Attributes:
        active: the node is active.
        planning: a call for a plan, or for a replan, waits or is served.
        published: a sequence is published.
        replanning: automatic replanning waits or is under way.
        validity: last validation result of the published sequence.
        is_news: `validity` or `replanning` changed after the newest call began or ended.
        call_error: error of the newest call, while it counts; `NO_ERROR` otherwise.
        sequence_error: error behind `Validity.FAILED`; `NO_ERROR` otherwise.
    """

    active: bool = False
    planning: bool = False
    published: bool = False
    replanning: bool = False
    validity: Validity = Validity.UNKNOWN
    is_news: bool = False
    call_error: ErrorData = field(default=NO_ERROR)
    sequence_error: ErrorData = field(default=NO_ERROR)

    @property
    def call_failed(self) -> bool:
        """Whether the newest call failed, and this counts."""
        return self.call_error.code != ErrorCode.SUCCESS


@dataclass(frozen=True)
class Row:
    """A row of the status table.

    Attributes:
        activity: the activity where all conditions hold.
        shows_error: whether the status has the error of call or sequence; otherwise it has none.
        active: condition on the fact of that name; None holds always.
        planning: likewise.
        published: likewise.
        replanning: likewise.
        is_news: likewise.
        call_failed: likewise.
        validity: values of the fact for which the row holds; None holds always.
    """

    activity: Activity
    shows_error: bool = True
    active: bool | None = None
    planning: bool | None = None
    published: bool | None = None
    replanning: bool | None = None
    is_news: bool | None = None
    call_failed: bool | None = None
    validity: tuple[Validity, ...] | None = None

    def holds(self, facts: Facts) -> bool:
        """Whether all conditions of the row hold.

        Args:
            facts: the facts.
        """
        names = ("active", "planning", "published", "replanning", "is_news", "call_failed")
        return all(getattr(self, n) in (None, getattr(facts, n)) for n in names) and (
            self.validity is None or facts.validity in self.validity
        )


INVALID, FAILED = (Validity.INVALID,), (Validity.FAILED,)

STATUS_TABLE = (
    Row(Activity.IDLE, active=False),
    # News of the published sequence replace PLANNING until the next call begins or ends; a sequence
    # that is still valid is no news.
    Row(Activity.REPLANNING, planning=True, published=True, is_news=True, replanning=True),
    Row(
        Activity.INVALIDATED,
        planning=True,
        published=True,
        is_news=True,
        validity=INVALID,
    ),
    Row(Activity.FAILED, planning=True, published=True, is_news=True, validity=FAILED),
    Row(Activity.PLANNING, shows_error=False, planning=True),
    Row(Activity.FAILED, published=False, call_failed=True),
    Row(Activity.IDLE, published=False),
    Row(Activity.REPLANNING, replanning=True),
    # The status is not VALID until the sequence has been validated against the newest surfaces.
    Row(Activity.PLANNING, validity=(Validity.PLANNED,)),
    Row(Activity.REPLANNING, validity=(Validity.REPLANNED,)),
    Row(Activity.IDLE, validity=(Validity.UNKNOWN,)),
    Row(Activity.VALID, validity=(Validity.VALID,)),
    Row(Activity.INVALIDATED, validity=INVALID),
    Row(Activity.FAILED, validity=FAILED),
)
"""Activity and error by the facts; the first row that holds counts."""


def status_of(facts: Facts) -> tuple[Activity, ErrorData]:
    """Activity, and error in the status, from the facts: the first row of the table that holds.

    The error is that of the newest call, else that of the published sequence.

    Args:
        facts: the facts.
    """
    row = next(row for row in STATUS_TABLE if row.holds(facts))
    if not row.shows_error:
        return row.activity, NO_ERROR
    return row.activity, facts.call_error if facts.call_failed else facts.sequence_error


@dataclass(frozen=True)
class PlannerStatus:
    """The planner's status.

    Attributes:
        activity: what the planner does.
        error: why planning or validation failed; `NO_ERROR` otherwise.
        invalid: invalid states of the published sequence that are not executed yet.
        executed: index of the state that the robot is in; -1 where it is unknown.
        environment_version: version of the environment that the sequence was last validated
            against; 0 for none.
        surfaces_stamp: stamp of that environment's surfaces, nanoseconds of the ROS clock.
    """

    activity: Activity = Activity.IDLE
    error: ErrorData = field(default=NO_ERROR)
    invalid: tuple[InvalidState, ...] = ()
    executed: int = -1
    environment_version: int = 0
    surfaces_stamp: int = 0
