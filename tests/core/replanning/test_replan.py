"""Going on from a state: the kept part stays, the new one is clean, and failures say why."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from rbprm_core.body.state import State
from rbprm_core.budget import Budget
from rbprm_core.check import check_plan
from rbprm_core.environment import polygon_entry
from rbprm_core.errors import (
    Cancelled,
    GoalUnreachable,
    InvalidInput,
    NoGuideFound,
    RbprmError,
    StartUnreachable,
    TimeLimitReached,
)
from rbprm_core.failures import Cause
from rbprm_core.outcome import Outcome
from rbprm_core.plan_conversion.plan_to_states import states_from_plan
from rbprm_core.plan_conversion.states_to_plan import contact_plan, state_entry
from rbprm_core.planner import plan
from rbprm_core.replanning.replan import replan, replan_from_one_of
from rbprm_core.request import PlanRequest
from rbprm_core.robot.data import RobotData
from rbprm_core.scene import Scene, make_surface

Planned = tuple[RobotData, Scene, PlanRequest, Outcome]


def narrowed(scene: Scene) -> Scene:
    """The step without its right part: what stood there has to stand elsewhere."""
    ring = [[0.0, -0.1, 0.2], [2.0, -0.1, 0.2], [2.0, 1.0, 0.2], [0.0, 1.0, 0.2]]
    return scene.edited([make_surface("step", ring, 0.5)])


def violations(planned: Planned, scene: Scene, states: Sequence[State]) -> list[str]:
    data, _, request, outcome = planned
    whole = replace(outcome, states=tuple(states))
    found = contact_plan(whole, request, data.robot, polygon_entry(scene, "edited"))
    return [str(violation) for violation in check_plan(found).violations]


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_the_kept_part_stays_and_the_new_one_is_clean(climb: Planned, share: float) -> None:
    data, scene, request, outcome = climb
    kept = int(share * (len(outcome.states) - 1))
    told: list[int] = []
    revision = replan(
        outcome.states, kept, replace(request, seed=7), data, scene, Budget(60.0),
        lambda states: told.append(len(states)),
    )  # fmt: skip
    assert revision.first_changed == kept + 1
    assert all(a is b for a, b in zip(revision.states, outcome.states[: kept + 1], strict=False))
    assert violations(climb, scene, revision.states) == []
    assert told == list(range(kept + 1, len(revision.states) + 1))
    assert revision.states[-1].q[:3] == pytest.approx(request.goal.position)


def test_from_words_in_a_changed_scene(climb: Planned) -> None:
    data, scene, request, outcome = climb
    changed = narrowed(scene)
    words = [state_entry(data.robot, state) for state in outcome.states]
    states = states_from_plan(words, data.robot)
    last = next(i for i, s in enumerate(states) if any(c.surface == "step" for c in s.contacts)) - 1
    request = replace(request, bounds=replace(request.bounds, high=np.array([1.0, 0.5, 2.0])))
    revision = replan_from_one_of(states, [last, last // 2, 0], request, data, changed, Budget(60))
    assert violations(climb, changed, revision.states) == []


def test_a_quadruped_goes_on_too(trot: Planned) -> None:
    data, scene, request, outcome = trot
    revision = replan(outcome.states, 6, request, data, scene, Budget(60.0))
    assert violations(trot, scene, revision.states) == []


def test_a_state_whose_surface_is_gone_is_no_start(climb: Planned) -> None:
    data, scene, request, outcome = climb
    gone = scene.edited(removed=["ground"])
    with pytest.raises(StartUnreachable) as caught:
        replan(outcome.states, 2, request, data, gone, Budget(60.0))
    assert caught.value.failure.cause == Cause.SURFACE_LOST
    assert caught.value.failure.surface == "ground"
    assert caught.value.limb in ("left_leg", "right_leg")
    assert caught.value.states == outcome.states[:3]


def test_a_state_that_slips_is_no_start(climb: Planned) -> None:
    data, scene, request, outcome = climb
    ice = Scene([replace(surface, friction=0.05) for surface in scene.surfaces])
    slope = replace(request, gravity=np.array([0.0, 2.0, -9.6]))
    with pytest.raises(StartUnreachable) as caught:
        replan(outcome.states, 0, slope, data, ice, Budget(60.0))
    assert caught.value.failure.cause == Cause.LOW_ROBUSTNESS
    assert caught.value.failure.figure("threshold") == request.robustness_threshold


def test_friction_of_today_counts(climb: Planned) -> None:
    data, scene, request, outcome = climb
    rough = Scene([replace(surface, friction=0.8) for surface in scene.surfaces])
    revision = replan(outcome.states, 4, request, data, rough, Budget(60.0))
    assert {c.friction for c in revision.outcome.states[0].contacts} == {0.8}
    assert revision.states[4] is outcome.states[4]


def test_a_body_in_an_obstacle_is_no_start(climb: Planned) -> None:
    data, scene, request, outcome = climb
    x, y, z = outcome.states[0].q[:3]
    wall = [
        [x - 0.2, y - 0.3, z],
        [x + 0.2, y - 0.3, z],
        [x + 0.2, y + 0.3, z],
        [x - 0.2, y + 0.3, z],
    ]
    with pytest.raises(StartUnreachable) as caught:
        replan(
            outcome.states,
            0,
            request,
            data,
            scene.edited([make_surface("wall", wall, 0.5)]),
            Budget(60.0),
        )
    assert caught.value.failure.cause == Cause.TRUNK_COLLISION


def test_a_root_outside_the_bounds_is_named(climb: Planned) -> None:
    data, scene, request, outcome = climb
    bounds = replace(request.bounds, low=np.array([-0.1, -0.5, 0.6]))
    with pytest.raises(InvalidInput) as caught:
        replan(outcome.states, 0, replace(request, bounds=bounds), data, scene, Budget(60.0))
    assert caught.value.field == "history.root"


def test_another_robots_state_is_refused(climb: Planned, trot: Planned) -> None:
    data, scene, request, _ = climb
    with pytest.raises(InvalidInput) as caught:
        plan(request, data, scene, Budget(60.0), history=trot[3].states[:1])
    assert caught.value.field == "history.q"


@pytest.mark.parametrize("index", [-1, 10_000])
def test_a_state_that_is_not_there_is_refused(climb: Planned, index: int) -> None:
    data, scene, request, outcome = climb
    with pytest.raises(InvalidInput) as caught:
        replan(outcome.states, index, request, data, scene, Budget(60.0))
    assert caught.value.field == "from_state"
    with pytest.raises(InvalidInput):
        replan_from_one_of(outcome.states, [], request, data, scene, Budget(60.0))


def test_no_way_on_keeps_the_part_that_holds(climb: Planned) -> None:
    data, scene, request, outcome = climb
    gone = scene.edited(removed=["step"])
    with pytest.raises(RbprmError) as caught:
        replan_from_one_of(outcome.states, [3, 1, 0], request, data, gone, Budget(60.0))
    assert isinstance(caught.value, GoalUnreachable | NoGuideFound)
    kept = caught.value.states
    assert all(a is b for a, b in zip(kept, outcome.states, strict=False))


@pytest.mark.parametrize("error", [Cancelled, TimeLimitReached])
def test_what_was_found_until_the_end_is_kept(climb: Planned, error: type[RbprmError]) -> None:
    data, scene, request, outcome = climb
    grown: list[int] = []

    def enough() -> bool:
        return len(grown) > 4

    budget = Budget(60.0, cancelled=enough if error is Cancelled else None)

    def told(states: Sequence[State]) -> None:
        grown.append(len(states))
        if error is TimeLimitReached and enough():
            budget.time_limit = 1e-3

    with pytest.raises(error) as caught:
        replan(outcome.states, 2, request, data, scene, budget, told)
    assert len(caught.value.states) == grown[-1] == 7
    assert caught.value.statistics.counts["guides"] == 1


def test_the_budget_is_asked_all_the_time(climb: Planned) -> None:
    """Cancelled at the n-th question, planning ends at it: whatever n, nothing goes unasked."""
    data, scene, request, _ = climb
    asked = 0

    def count() -> bool:
        nonlocal asked
        asked += 1
        return False

    outcome = plan(request, data, scene, Budget(60.0, cancelled=count))
    # A state takes several candidates, and each of them is a question.
    assert asked > 5 * len(outcome.states)
    for limit in (1, 5, 20, asked // 2):
        left = limit

        def stop() -> bool:
            nonlocal left
            left -= 1
            return left <= 0

        with pytest.raises(Cancelled):
            plan(request, data, scene, Budget(60.0, cancelled=stop))
        assert left == 0
