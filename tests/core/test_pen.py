"""A hand re-grasps a pen in zero gravity: plans from end to end, and what the check refuses."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from rbprm_core.budget import Budget
from rbprm_core.check import CheckReport, Kind, check_plan
from rbprm_core.errors import InvalidInput
from rbprm_core.outcome import Outcome
from rbprm_core.plan_conversion.states_to_plan import contact_plan
from rbprm_core.plan_record import ContactPlan, StateEntry
from rbprm_core.planner import plan
from rbprm_core.robot.data import RobotData
from rbprm_core.scenario import Scenario, load_scenario

GRIP = 10.0


@pytest.fixture(scope="module")
def pen() -> Scenario:
    return load_scenario("pen")


def planned(data: RobotData, pen: Scenario, seed: int, threshold: float = 0.0) -> Outcome:
    request = pen.request_for(data.robot, seed, threshold)
    return plan(request, data, pen.scene(), Budget(30.0))


def written(
    data: RobotData, pen: Scenario, outcome: Outcome, threshold: float = 0.0
) -> ContactPlan:
    request = pen.request_for(data.robot, 0, threshold)
    return contact_plan(outcome, request, data.robot, pen.environment_entry())


@pytest.fixture(scope="module")
def pen_plan(allegro_data: RobotData, pen: Scenario) -> ContactPlan:
    return written(allegro_data, pen, planned(allegro_data, pen, 0))


@pytest.fixture(scope="module")
def pen_report(pen_plan: ContactPlan) -> CheckReport:
    return check_plan(pen_plan)


def test_the_hand_goes_from_end_to_end(pen_plan: ContactPlan, pen_report: CheckReport) -> None:
    assert [str(violation) for violation in pen_report.violations] == []
    assert pen_report.transitions >= 6
    assert pen_plan.request.gravity == (0, 0, 0)
    for state in pen_plan.states:
        assert {contact.limb for contact in state.contacts} == {"index", "middle", "thumb"}
    moved = pen_plan.states[-1].root.position[1] - pen_plan.states[0].root.position[1]
    assert moved == pytest.approx(0.1, abs=1e-3)
    for limb in ("index", "middle", "thumb"):
        ends = [contact_of(pen_plan.states[k], limb) for k in (0, -1)]
        assert ends[1][1] - ends[0][1] > 0.03


def test_every_state_is_in_force_closure(pen_plan: ContactPlan, pen_report: CheckReport) -> None:
    declared = [state.robustness for state in pen_plan.states]
    assert min(declared) > 0
    assert max(declared) <= GRIP / 12 + 1e-9
    assert list(pen_report.robustness) == pytest.approx(declared, abs=1e-5 * GRIP)


def test_opposed_fingers(pen_plan: ContactPlan) -> None:
    """Not all fingers push to one side."""
    for state in pen_plan.states:
        normals = np.array([contact.normal for contact in state.contacts])
        assert (normals @ normals.T).min() < -0.3


def test_the_same_request_gives_the_same_plan(
    allegro_data: RobotData, pen: Scenario, pen_plan: ContactPlan
) -> None:
    again = written(allegro_data, pen, planned(allegro_data, pen, 0))
    assert again.states == pen_plan.states
    assert again.guide == pen_plan.guide


@pytest.mark.parametrize("threshold", [0.1, 0.2])
def test_firmer_grips_can_be_asked_for(
    allegro_data: RobotData, pen: Scenario, threshold: float
) -> None:
    outcome = planned(allegro_data, pen, 1, threshold)
    assert min(state.robustness for state in outcome.states) >= threshold
    assert check_plan(written(allegro_data, pen, outcome, threshold)).valid


def test_a_plan_survives_its_file(pen_plan: ContactPlan, tmp_path: Path) -> None:
    path = tmp_path / "pen.json"
    pen_plan.write(path)
    read = ContactPlan.read(path)
    assert read.request.grip_force == GRIP
    assert check_plan(read).valid


def test_the_check_refuses_a_lost_finger(pen_plan: ContactPlan) -> None:
    first = pen_plan.states[0]
    two = first.model_copy(update={"contacts": first.contacts[:2]})
    report = check_plan(pen_plan.model_copy(update={"states": (two, *pen_plan.states[1:])}))
    found = [str(v) for v in report.violations if v.state == 0 and v.kind is Kind.STATICS]
    assert any("force closure" in text for text in found)


def test_the_check_refuses_another_grip_force(pen_plan: ContactPlan) -> None:
    request = pen_plan.request.model_copy(update={"grip_force": 2 * GRIP})
    report = check_plan(pen_plan.model_copy(update={"request": request}))
    assert {violation.kind for violation in report.violations} == {Kind.ROBUSTNESS}


def test_gravity_is_the_scenarios(allegro_data: RobotData, pen: Scenario) -> None:
    request = pen.request_for(allegro_data.robot)
    assert not request.gravity.any()
    assert request.grip_force == GRIP
    flat = load_scenario("flat")
    assert flat.request_for(flat.load_robot()).gravity.tolist() == [0, 0, -9.81]


@pytest.mark.parametrize(
    ("line", "field"),
    [
        ("gravity = [0.0, 0.0]", "gravity"),
        ('gravity = "none"', "gravity"),
        ("gravity = [0.0, 0.0, nan]", "gravity"),
        ("grip_force = 0.0", "grip_force"),
        ("grip_force = -1.0", "grip_force"),
    ],
)
def test_bad_gravity_and_grip_are_named(tmp_path: Path, line: str, field: str) -> None:
    text = (Path(load_scenario.__code__.co_filename).parent / "scenarios/pen.toml").read_text()
    kept = [row for row in text.splitlines() if not row.startswith(field)]
    kept.insert(kept.index("[request]") + 1, line)
    path = tmp_path / "bad.toml"
    path.write_text("\n".join(kept))
    with pytest.raises(InvalidInput, match=rf"request\.{field}"):
        load_scenario(str(path))


def contact_of(state: StateEntry, limb: str) -> tuple[float, float, float]:
    return next(contact.position for contact in state.contacts if contact.limb == limb)
