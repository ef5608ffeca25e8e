"""Planned sequences with the posture generators of their robots and scenes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import pytest

from rbprm_core.arrays import Array
from rbprm_core.body import Action, Contact, State, Transition, WholeBody
from rbprm_core.budget import Budget
from rbprm_core.planner import plan
from rbprm_core.posture.generator import SqpPostureGenerator
from rbprm_core.posture.model import PostureModel
from rbprm_core.posture.problem import PostureProblem
from rbprm_core.posture.protocol import PostureOptions, PostureSetting
from rbprm_core.request import PlanRequest
from rbprm_core.robot import Robot
from rbprm_core.robot.data import RobotData
from rbprm_core.scenario import load_scenario
from rbprm_core.scene import Scene


@dataclass(frozen=True, eq=False)
class Sequence:
    """A planned sequence of a scenario.

    Attributes:
        data: the robot with its data.
        scene: the environment.
        request: the request.
        states: the planned states.
        setting: what a posture generator is made for.
        model: the robot in its scene.
        generator: a generator with the default options.
    """

    data: RobotData
    scene: Scene
    request: PlanRequest
    states: tuple[State, ...]
    setting: PostureSetting
    model: PostureModel
    generator: SqpPostureGenerator

    @property
    def robot(self) -> Robot:
        return self.data.robot

    def solver(self, **options: object) -> SqpPostureGenerator:
        """A generator with options of its own."""
        return SqpPostureGenerator(self.setting, PostureOptions(**options))  # type: ignore[arg-type]

    def witnesses(self) -> Iterator[tuple[tuple[Contact, ...], tuple[Contact, ...], Array]]:
        """Contacts, supporting contacts and start of the witnesses of all transitions."""
        for before, after in zip(self.states, self.states[1:], strict=False):
            transition = Transition.between(before, after)
            if transition.action in (Action.BREAK, Action.MOVE):
                yield before.contacts, transition.shared_contacts, before.q
            if transition.action in (Action.MAKE, Action.MOVE):
                yield after.contacts, transition.shared_contacts, after.q

    def problem(self, index: int, min_robustness: float = 5.0) -> tuple[PostureProblem, Array]:
        """The problem and start of one of the witnesses."""
        contacts, supporting, start = list(self.witnesses())[index]
        return PostureProblem(contacts, supporting, min_robustness), start


def sequence(name: str, data: RobotData) -> Sequence:
    text = load_scenario(name)
    request, scene = text.request_for(data.robot), text.scene()
    states = plan(request, data, scene, Budget(60.0)).states
    body = WholeBody(data, scene, request.gravity, request.robustness_threshold)
    setting = PostureSetting(data, scene, body, request.gravity)
    generator = SqpPostureGenerator(setting)
    return Sequence(data, scene, request, states, setting, PostureModel(setting), generator)


@pytest.fixture(scope="session")
def rubble_walk(hyq_data: RobotData) -> Sequence:
    """HyQ over the rubble."""
    return sequence("rubble", hyq_data)


@pytest.fixture(scope="session")
def stair_climb(talos_data: RobotData) -> Sequence:
    """Talos up stairs of 10 cm."""
    return sequence("stairs10", talos_data)


@pytest.fixture(scope="session")
def high_step(talos_data: RobotData) -> Sequence:
    """Talos onto a step of 30 cm, with a hand on it."""
    return sequence("step30", talos_data)


Walks = Callable[[str], Sequence]


@pytest.fixture(scope="session")
def walks(rubble_walk: Sequence, stair_climb: Sequence, high_step: Sequence) -> Walks:
    """The sequences by name of the scenario."""
    known = {"rubble": rubble_walk, "stairs10": stair_climb, "step30": high_step}
    return known.__getitem__
