"""The later part of a sequence planned anew, from one of its states on."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from rbprm_core.body.state import State
from rbprm_core.budget import Budget
from rbprm_core.errors import (
    InvalidInput,
    NoGuideFound,
    NoSequenceFound,
    RbprmError,
    StartUnreachable,
)
from rbprm_core.guide.root import RoadmapStore
from rbprm_core.planner import Outcome, plan
from rbprm_core.request import PlanRequest
from rbprm_core.robot.data import RobotData
from rbprm_core.scene import Scene

FEW_GUIDES = 2
"""Guides tried from a state while there are earlier ones to go on from: what two guides do not
find, an earlier state finds sooner than twenty more."""


@dataclass(frozen=True, eq=False)
class Revision:
    """A sequence whose later part is new.

    Attributes:
        states: the whole sequence; those before `first_changed` are the same objects as before.
        first_changed: index of the first new state; the number of states where there is none.
        outcome: of the planning, whose first state is the last one that was kept.
    """

    states: tuple[State, ...]
    first_changed: int
    outcome: Outcome


def replan(
    plan_states: Sequence[State],
    from_state: int,
    request: PlanRequest,
    data: RobotData,
    scene: Scene,
    budget: Budget,
    on_states: Callable[[Sequence[State]], None] | None = None,
    roadmaps: RoadmapStore | None = None,
) -> Revision:
    """Keep a sequence up to one of its states and plan on from there to the request's goal.

    Args:
        from_state: index of the last state that is kept.
        request: its start is not looked at.
        on_states: told the whole sequence so far, the kept states first, whenever it has grown.

    Raises:
        InvalidInput: there is no state of this index; see `plan`.
        RbprmError: see `plan`. The error's `states` are the whole sequence as far as it got, with
            the kept states in any case; where only it and not the goal was reached, `state` and
            text count from the sequence's first state.
    """
    if not 0 <= from_state < len(plan_states):
        reason = f"must be the index of a state: there are {len(plan_states)}"
        raise InvalidInput("from_state", from_state, reason)
    kept = tuple(plan_states[: from_state + 1])

    def grown(states: Sequence[State]) -> None:
        if on_states is not None:
            on_states((*kept, *states[1:]))

    try:
        outcome = plan(request, data, scene, budget, roadmaps, first=kept[-1], on_states=grown)
    except RbprmError as error:
        raise _counted(error, kept) from error
    return Revision((*kept, *outcome.states[1:]), len(kept), outcome)


def replan_from_one_of(
    plan_states: Sequence[State],
    candidates: Sequence[int],
    request: PlanRequest,
    data: RobotData,
    scene: Scene,
    budget: Budget,
    on_states: Callable[[Sequence[State]], None] | None = None,
    roadmaps: RoadmapStore | None = None,
) -> Revision:
    """As `replan`, from the first of some states that leads to the goal.

    Args:
        candidates: indices of states, as `rbprm_core.replanning.policy.Replan` has them.

    Raises:
        InvalidInput: no candidates; see `replan`.
        RbprmError: see `replan`; of the candidate that came farthest, where none led there.
    """
    if not candidates:
        raise InvalidInput("candidates", [], "must name a state at least")
    hasty = replace(
        request,
        options=replace(request.options, guides=min(FEW_GUIDES, request.options.guides)),
    )
    failures: list[RbprmError] = []
    for k, index in enumerate(candidates):
        asked = hasty if k + 1 < len(candidates) else request
        try:
            return replan(plan_states, index, asked, data, scene, budget, on_states, roadmaps)
        except (StartUnreachable, NoGuideFound, NoSequenceFound) as error:
            failures.append(error)
    raise max(failures, key=lambda error: len(error.states))


def _counted(error: RbprmError, kept: tuple[State, ...]) -> RbprmError:
    """The error with states counted from the sequence's first."""
    states = (*kept, *error.states[1:])
    if isinstance(error, NoSequenceFound):
        statistics = error.statistics
        index = error.state + len(kept) - 1
        error = NoSequenceFound(index, error.limb, error.reason, error.fraction, states)
        error.statistics = statistics
    error.states = states
    return error
