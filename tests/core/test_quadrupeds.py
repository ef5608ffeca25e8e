"""The scenarios for quadrupeds: planned, held against the independent check, and what they show."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from rbprm_core.budget import Budget
from rbprm_core.check import check_plan
from rbprm_core.plan_conversion.states_to_plan import contact_plan
from rbprm_core.plan_record import ContactPlan
from rbprm_core.planner import plan
from rbprm_core.robot.data import RobotData
from rbprm_core.scenario import known_scenarios, load_scenario

SCRIPTS = Path(__file__).parents[2] / "scripts"
SEED = 7


def planned(name: str, data: RobotData) -> ContactPlan:
    """A plan of a scenario that the check finds nothing wrong with."""
    text = load_scenario(name)
    request = text.request_for(data.robot, SEED)
    outcome = plan(request, data, text.scene(), Budget(60.0))
    found = contact_plan(outcome, request, data.robot, text.environment_entry())
    report = check_plan(found)
    assert report.valid, report.violations
    assert report.min_robustness >= request.robustness_threshold - 1e-6
    assert found.states[-1].root.position == pytest.approx(request.goal.position.tolist())
    return found


def test_the_race_leads_over_the_hole_and_along_the_bridge(hyq_data: RobotData) -> None:
    feet = np.array([c.position for s in planned("race", hyq_data).states for c in s.contacts])
    assert not ((feet[:, 0] > -4.16) & (feet[:, 0] < -3.63)).any()
    bridge = feet[(feet[:, 0] > -0.6) & (feet[:, 0] < 1.8)]
    assert len(bridge) > 20
    assert np.ptp(bridge[:, 1]) < 0.251


def test_the_slalom_leads_round_the_wall(hyq_data: RobotData) -> None:
    states = planned("slalom", hyq_data).states
    roots = np.array([state.root.position for state in states])
    beside = np.abs(roots[:, 0] - 0.53) < 0.1  # the wall across the way is at x = 0.53
    assert beside.any()
    assert roots[beside, 1].min() > 0.7  # and ends at y = 0.52
    debris = {c.surface for s in states for c in s.contacts if abs(c.normal[2]) < 0.99}
    assert len(debris) >= 2


def test_go2_crosses_rubble_of_its_size(go2_data: RobotData) -> None:
    planned("rubble_half", go2_data)


def test_anymal_crosses_rubble_of_its_size(anymal_data: RobotData) -> None:
    planned("rubble_three_quarters", anymal_data)


@pytest.mark.parametrize(("name", "scale"), [("rubble_half", 0.5), ("rubble_three_quarters", 0.75)])
def test_the_scaled_rubble_is_what_the_script_makes(name: str, scale: float) -> None:
    command = [sys.executable, str(SCRIPTS / "scale_scenario.py"), "rubble", str(scale)]
    made = subprocess.run(command, capture_output=True, text=True, timeout=240, check=True).stdout
    text = known_scenarios()[name].read_text()
    assert text.endswith(made)
    areas = [
        sum(surface.polygon.area for surface in load_scenario(which).scene().surfaces)
        for which in (name, "rubble")
    ]
    assert areas[0] == pytest.approx(scale**2 * areas[1], rel=1e-3)
