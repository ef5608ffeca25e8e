"""Single problems: witnesses of transitions, explained failures, and figures on postures."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rbprm_core.body import Action, State, Transition
from rbprm_core.errors import InvalidInput
from rbprm_core.failures import Cause, Failure
from rbprm_core.posture import (
    PostureProblem,
    WitnessEnd,
    generate_posture,
    posture_setting,
    witness_problem,
)
from rbprm_core.posture.constraints.tasks import Upright
from rbprm_core.posture.model import REACH
from rbprm_core.posture.quality import posture_quality

from .conftest import Sequence

UP = np.array([0.0, 0.0, 1.0])


def transition_that(walk: Sequence, action: Action) -> Transition:
    pairs = zip(walk.states, walk.states[1:], strict=False)
    return next(t for t in (Transition.between(*pair) for pair in pairs) if t.action is action)


def test_a_moved_contact_has_two_witnesses(rubble_walk: Sequence) -> None:
    move = transition_that(rubble_walk, Action.MOVE)
    for end, state in ((WitnessEnd.LIFT_OFF, move.before), (WitnessEnd.TOUCH_DOWN, move.after)):
        problem, start = witness_problem(move, end, 5.0, 0.8)
        assert problem.contacts == state.contacts
        assert problem.supporting == move.shared_contacts
        assert (problem.min_robustness, problem.max_torque_ratio) == (5.0, 0.8)
        assert start is state.q


def test_a_broken_contact_has_no_touch_down(rubble_walk: Sequence) -> None:
    state = rubble_walk.states[0]
    lifted = replace(state, contacts=state.contacts[1:])
    breaks, makes = Transition.between(state, lifted), Transition.between(lifted, state)
    assert witness_problem(breaks, WitnessEnd.LIFT_OFF, 0.0)[0].contacts == state.contacts
    assert witness_problem(makes, WitnessEnd.TOUCH_DOWN, 0.0)[0].contacts == state.contacts
    with pytest.raises(InvalidInput, match="it has lift-off"):
        witness_problem(breaks, WitnessEnd.TOUCH_DOWN, 0.0)
    with pytest.raises(InvalidInput, match="it has neither"):
        witness_problem(Transition.between(state, state), WitnessEnd.LIFT_OFF, 0.0)


def test_a_problem_is_solved_without_a_planner(rubble_walk: Sequence) -> None:
    setting = posture_setting(rubble_walk.data, rubble_walk.scene)
    move = transition_that(rubble_walk, Action.MOVE)
    found = generate_posture(setting, *witness_problem(move, WitnessEnd.LIFT_OFF, 5.0))
    expected = rubble_walk.generator.solve(*witness_problem(move, WitnessEnd.LIFT_OFF, 5.0))
    assert isinstance(found, State)
    assert isinstance(expected, State)
    assert np.array_equal(found.q, expected.q)
    with pytest.raises(InvalidInput, match="generator"):
        generate_posture(setting, *witness_problem(move, WitnessEnd.LIFT_OFF, 5.0), generator="no")


def test_a_failure_names_the_largest_robustness(rubble_walk: Sequence) -> None:
    """That bound itself can be reached, a bit more cannot."""
    state = rubble_walk.states[0]
    problem = PostureProblem(state.contacts, state.contacts, 1e3)
    failure = generate_posture(rubble_walk.setting, problem, state.q)
    assert isinstance(failure, Failure)
    assert failure.cause is Cause.LOW_ROBUSTNESS
    reached = failure.figure("robustness")
    assert state.robustness - 1.0 < reached < 1e3
    eased = replace(problem, min_robustness=0.95 * reached)
    assert isinstance(generate_posture(rubble_walk.setting, eased, state.q), State)
    harder = replace(problem, min_robustness=1.1 * reached)
    assert isinstance(generate_posture(rubble_walk.setting, harder, state.q), Failure)


def test_contacts_come_first_in_explanations(rubble_walk: Sequence) -> None:
    """Neither robustness nor a task matters where a contact is out of reach."""
    state, robot = rubble_walk.states[0], rubble_walk.robot
    first = state.contacts[0]
    away = replace(first, position=first.position + 2 * UP, points=first.points + 2 * UP)
    task = Upright(robot, "trunk", UP, -UP, 0.1)
    problem = PostureProblem((away, *state.contacts[1:]), state.contacts, 1e3, tasks=(task,))
    failure = generate_posture(rubble_walk.setting, problem, state.q)
    assert isinstance(failure, Failure)
    assert failure.cause is Cause.CONTACT_NOT_REACHED
    assert failure.figure("distance") > 0.1


def test_torques_are_explained_last(high_step: Sequence) -> None:
    state = high_step.states[0]
    problem = PostureProblem(state.contacts, state.contacts, 5.0, max_torque_ratio=0.01)
    failure = generate_posture(high_step.setting, problem, state.q)
    assert isinstance(failure, Failure)
    assert failure.cause is Cause.TORQUE_LIMIT
    assert failure.figure("ratio") > 0.01


def test_the_figures_on_a_posture(high_step: Sequence) -> None:
    state, model = high_step.states[0], high_step.model
    quality = posture_quality(model, state, state.contacts)
    assert quality.robustness == pytest.approx(state.robustness)
    assert quality.balance.ratio == model.torques.balance(state.q, state.contacts).ratio
    index = high_step.robot.joint_names.index(quality.joint)
    low, high = high_step.robot.low[7:], high_step.robot.high[7:]
    value = state.q[7 + index]
    assert quality.joint_margin == min(value - low[index], high[index] - value)
    assert quality.contact_error < 1e-3
    assert 0.0 < quality.clearance <= REACH
    assert (quality.clearance == REACH) == (quality.bodies == ("", ""))
