"""Finished sequences to go on from: a humanoid's on patches, a quadruped's on points."""

from __future__ import annotations

import pytest

from rbprm_core.budget import Budget
from rbprm_core.planner import Outcome, plan
from rbprm_core.request import PlanRequest
from rbprm_core.robot.data import RobotData
from rbprm_core.scenario import load_scenario
from rbprm_core.scene import Scene

Planned = tuple[RobotData, Scene, PlanRequest, Outcome]


def planned(name: str, data: RobotData) -> Planned:
    text = load_scenario(name)
    request, scene = text.request_for(data.robot), text.scene()
    return data, scene, request, plan(request, data, scene, Budget(60.0))


@pytest.fixture(scope="session")
def climb(talos_data: RobotData) -> Planned:
    """Talos over a step of 20 cm: surfaces ground, riser and step."""
    return planned("step20", talos_data)


@pytest.fixture(scope="session")
def trot(hyq_data: RobotData) -> Planned:
    """HyQ on flat ground."""
    return planned("flat", hyq_data)
