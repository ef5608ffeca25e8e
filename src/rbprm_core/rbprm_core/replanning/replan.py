"""Replanning of the later part of a sequence, from one of its states on."""

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
from rbprm_core.outcome import Outcome
from rbprm_core.planner import plan
from rbprm_core.request import PlanRequest
from rbprm_core.robot.data import RobotData
from rbprm_core.scene import Scene

FEW_GUIDES = 2
"""Guides tried from a state while there are earlier states to replan from.

Where two guides fail, an earlier state finds a plan sooner than twenty more guides.
"""


@dataclass(frozen=True, eq=False)
class Revision:
    """A sequence whose later part is new.

    Attributes:
        states: the whole sequence; the states before `first_changed` are the same objects as
            before.
        first_changed: index of the first new state; the number of states where there is none.
        outcome: outcome of the planning; its first state is the last kept one.
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
    """The sequence kept up to one of its states, and planned from there to the request's goal.

    Args:
        plan_states: states of the sequence.
        from_state: index of the last state to keep.
        request: goal and conditions; its start is not used.
        data: the robot with its precomputed data.
        scene: supporting surfaces and obstacles of the present.
        budget: time limit, cancel flag and progress.
        on_states: called with the whole sequence so far, the kept states first, whenever a state
            is added.
        roadmaps: roadmaps that the caller keeps between requests.

    Raises:
        InvalidInput: no state has this index; see `plan`.
        RbprmError: see `plan`. The error's `states` are the whole sequence found, the kept states
            included; `NoSequenceFound.state` counts from the sequence's first state.
    """
    if not 0 <= from_state < len(plan_states):
        reason = f"must be the index of a state: there are {len(plan_states)}"
        raise InvalidInput("from_state", from_state, reason)
    kept = tuple(plan_states[: from_state + 1])

    def grown(states: Sequence[State]) -> None:
        if on_states is not None:
            on_states((*kept, *states[1:]))

    try:
        outcome = plan(request, data, scene, budget, roadmaps, history=kept, on_states=grown)
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
    """As `replan`, from the first of some states from which a plan is found.

    Args:
        plan_states: states of the sequence.
        candidates: indices of states, as in `rbprm_core.replanning.policy.Replan`.
        request: goal and conditions; its start is not used.
        data: the robot with its precomputed data.
        scene: supporting surfaces and obstacles of the present.
        budget: time limit, cancel flag and progress of all candidates together.
        on_states: called with the whole sequence so far, the kept states first, whenever a state
            is added.
        roadmaps: roadmaps that the caller keeps between requests.

    Raises:
        InvalidInput: no candidates; see `replan`.
        RbprmError: see `replan`; where no candidate succeeds, the failure with most states.
    """
    if not candidates:
        raise InvalidInput("candidates", [], "must name a state at least")
    limited = replace(
        request,
        options=replace(request.options, guides=min(FEW_GUIDES, request.options.guides)),
    )
    failures: list[RbprmError] = []
    for k, index in enumerate(candidates):
        chosen = limited if k + 1 < len(candidates) else request
        try:
            return replan(plan_states, index, chosen, data, scene, budget, on_states, roadmaps)
        except (StartUnreachable, NoGuideFound, NoSequenceFound) as error:
            failures.append(error)
    raise max(failures, key=lambda error: len(error.states))


def _counted(error: RbprmError, kept: tuple[State, ...]) -> RbprmError:
    """The error with states counted from the sequence's first."""
    states = (*kept, *error.states[1:])
    if isinstance(error, NoSequenceFound):
        statistics = error.statistics
        index = error.state + len(kept) - 1
        error = NoSequenceFound(index, error.failure, error.fraction, states)
        error.statistics = statistics
    error.states = states
    return error
