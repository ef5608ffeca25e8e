"""Every scenario that comes with the package is planned, and its plan held against the check."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from rbprm_core.budget import Budget
from rbprm_core.check import check_plan
from rbprm_core.plan_conversion.states_to_plan import contact_plan
from rbprm_core.plan_record import ContactPlan
from rbprm_core.planner import plan
from rbprm_core.robot.data import RobotData
from rbprm_core.scenario import Scenario, known_scenarios, load_scenario

ELSEWHERE = {"stepladder"}  # planned by test_stepladder.py; its robot's data take long

DataOf = Callable[[Scenario], RobotData]


def planned(name: str, scenario_data: DataOf) -> ContactPlan:
    """The plan of a scenario with seed 0."""
    scenario = load_scenario(name)
    data = scenario_data(scenario)
    request = scenario.request_for(data.robot)
    outcome = plan(request, data, scenario.scene(), Budget(120.0))
    return contact_plan(outcome, request, data.robot, scenario.environment_entry())


def normals(found: ContactPlan, limbs: tuple[str, ...]) -> np.ndarray:
    """Normals (m, 3) of the contacts that limbs make anywhere in a plan."""
    contacts = [contact for state in found.states for contact in state.contacts]
    return np.array([contact.normal for contact in contacts if contact.limb in limbs])


@pytest.mark.parametrize("name", sorted(known_scenarios().keys() - ELSEWHERE))
def test_a_plan_is_found_and_valid(name: str, scenario_data: DataOf) -> None:
    found = planned(name, scenario_data)
    report = check_plan(found)
    assert [str(violation) for violation in report.violations] == []
    assert report.min_robustness >= found.request.robustness_threshold - 1e-3
    assert report.goal_limbs
    assert report.goal_missing == ()
    slack = found.request.position_tolerance + 1e-9
    goal = found.request.goal.position
    assert found.states[-1].root.position == pytest.approx(goal, abs=slack)
    if name == "stairs":  # the hand holds the rail, which rises with the stairs
        rail = normals(found, ("right_arm",)) @ (-0.45, 0.0, 0.89)
        assert (rail > 0.99).any()
    elif name == "standing":  # the hands lean on the wall in the end
        wall = normals(found, ("left_arm", "right_arm")) @ (-1.0, 0.0, 0.0)
        assert (wall > 0.99).any()
