"""Talos climbs the stepladder on toes and fingertips."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from rbprm_core.budget import Budget
from rbprm_core.check import CheckReport, check_plan
from rbprm_core.plan_conversion.states_to_plan import contact_plan
from rbprm_core.plan_record import ContactPlan
from rbprm_core.planner import plan
from rbprm_core.robot.data import RobotData
from rbprm_core.scenario import Scenario, load_scenario

RUNGS = (0.275, 0.546, 0.817, 1.08)  # metres; the last is the platform
FEET = ("left_toe", "right_toe")


@pytest.fixture(scope="module")
def ladder_plan(scenario_data: Callable[[Scenario], RobotData]) -> ContactPlan:
    scenario = load_scenario("stepladder")
    data = scenario_data(scenario)
    request = scenario.request_for(data.robot, 1)
    outcome = plan(request, data, scenario.scene(), Budget(60.0))
    return contact_plan(outcome, request, data.robot, scenario.environment_entry())


@pytest.fixture(scope="module")
def ladder_report(ladder_plan: ContactPlan) -> CheckReport:
    return check_plan(ladder_plan)


def test_the_check_finds_nothing(ladder_report: CheckReport) -> None:
    assert [str(violation) for violation in ladder_report.violations] == []
    assert ladder_report.goal_limbs
    assert ladder_report.goal_missing == ()


def test_feet_climb_from_the_ground_over_rungs(ladder_plan: ContactPlan) -> None:
    for foot in FEET:
        heights = {
            round(contact.position[2], 3)
            for state in ladder_plan.states
            for contact in state.contacts
            if contact.limb == foot
        }
        assert heights <= {0.0, *RUNGS}
        assert 0.0 in heights
        assert len(heights) >= 3  # the ground, and two rungs at least


def test_all_four_limbs_bear_and_hands_move_along(ladder_plan: ContactPlan) -> None:
    for hand in ("left_fingertip", "right_fingertip"):
        heights = [
            contact.position[2]
            for state in ladder_plan.states
            for contact in state.contacts
            if contact.limb == hand
        ]
        assert max(heights) - min(heights) > 0.5
