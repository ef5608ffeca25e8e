"""Witness postures of all transitions, verified by the check, which shares no code with posture."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rbprm_core.body import State
from rbprm_core.check import check_plan
from rbprm_core.check.static_equilibrium import state_robustness, weight
from rbprm_core.check.violation import Kind
from rbprm_core.plan_conversion.states_to_plan import bare_plan, state_entry
from rbprm_core.plan_record import ContactPlan
from rbprm_core.posture.problem import PostureProblem
from rbprm_core.scenario import load_scenario

from .conftest import Sequence, Walks

MIN_ROBUSTNESS = 5.0
OF_SEQUENCES = {Kind.START, Kind.GOAL, Kind.CHANGES, Kind.KEPT_FRICTION, Kind.DRIFT}
"""Kinds of violations between states, or of the first and last: witnesses are no sequence."""


def as_plan(walk: Sequence, name: str, states: list[State]) -> ContactPlan:
    """Postures as the states of a plan, each with its robustness on all contacts."""
    stability = walk.model.stability
    whole = [replace(s, robustness=stability.b0(s.contacts, s.com)) for s in states]
    plan = bare_plan([state_entry(walk.robot, s) for s in whole], walk.request, walk.robot)
    environment = load_scenario(name).environment_entry()
    return plan.model_copy(update={"environment": environment})


@pytest.mark.parametrize("name", ["rubble", "stairs10", "step30"])
def test_all_transitions_have_their_witnesses(walks: Walks, name: str) -> None:
    walk = walks(name)
    postures, supports = [], []
    for contacts, supporting, start in walk.witnesses():
        problem = PostureProblem(contacts, supporting, MIN_ROBUSTNESS, max_torque_ratio=1.0)
        found = walk.generator.solve(problem, start)
        assert isinstance(found, State), found
        assert found.contacts == contacts
        postures.append(found)
        supports.append({walk.robot.limbs[contact.limb].name for contact in supporting})
    assert len(postures) > 8
    plan = as_plan(walk, name, postures)
    report = check_plan(plan)
    wrong = [v for v in report.violations if v.kind not in OF_SEQUENCES]
    assert not wrong, [str(violation) for violation in wrong[:5]]
    load = weight(walk.robot.mass, plan.request.gravity)
    for entry, names in zip(plan.states, supports, strict=True):
        stance = tuple(contact for contact in entry.contacts if contact.limb in names)
        b0, _ = state_robustness(stance, np.array(entry.com), load, plan.request.grip_force)
        assert b0 >= MIN_ROBUSTNESS - 1e-6
