"""What a plan depends on, from a scenario file or from the file of an earlier plan."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from rbprm_core.environment import environment_classification, load_scene
from rbprm_core.errors import InvalidInput
from rbprm_core.placement import Placement
from rbprm_core.plan_record import ContactPlan, EnvironmentEntry, Pose
from rbprm_core.request import PlanRequest, StageNames, read_options
from rbprm_core.robot import Robot, RobotDescription
from rbprm_core.scenario import known_scenarios, load_scenario
from rbprm_core.scene import Scene
from rbprm_core.validation import naming_fields, parse_record

ROUNDING = 1e-15
"""Change of a unit quaternion's entries when it is normalised again."""
TIME_LIMIT = 60.0
"""Longest planning time where no file sets one, seconds."""


@dataclass(frozen=True, eq=False)
class PlanningInput:
    """A robot, its environment and the request.

    Attributes:
        robot: robot with the limbs, heuristics, surfaces and trunk that were chosen for it.
        environment: meshes and polygons, and how they are classified.
        request: validated request; its time limit is always set.
    """

    robot: Robot
    environment: EnvironmentEntry
    request: PlanRequest

    def scene(self) -> Scene:
        """The environment read and cut into contact surfaces.

        Raises:
            InvalidInput: a mesh or polygon that cannot be used.
        """
        return load_scene(self.environment, environment_classification(self.environment))


def is_plan_file(name: str) -> bool:
    """True where a name is the path of a plan file rather than of a scenario.

    Args:
        name: name of a known scenario, or path of a file.
    """
    return name not in known_scenarios() and Path(name).suffix == ".json"


def input_from_scenario(
    scenario: str, robot: str | None = None, seed: int = 0, robustness: float | None = None
) -> PlanningInput:
    """Robot, environment and request of a scenario.

    Args:
        scenario: known name, or path of a scenario file.
        robot: known name or path of a robot file; the scenario's own robot where None.
        seed: seed of the random generator.
        robustness: minimum raw b0 in newtons; the scenario's where None.

    Raises:
        InvalidInput: a field of a file at fault.
    """
    text = load_scenario(scenario)
    model = text.load_robot(robot)
    request = text.request_for(model, seed, robustness)
    return PlanningInput(model, text.environment_entry(), request)


def input_from_plan(
    plan: ContactPlan, seed: int | None = None, robustness: float | None = None
) -> PlanningInput:
    """Robot, environment and request of a plan, to plan it again: nothing else gives other states.

    Args:
        plan: plan of format version 2, as the planner writes it.
        seed: seed of the random generator; the plan's where None.
        robustness: minimum raw b0 in newtons; the plan's where None.

    Raises:
        InvalidInput: a field of the plan that cannot be used, or that is missing: plans of version
            1, and those made from messages, do not hold the whole request.
    """
    entry = plan.request
    for field, value in (
        ("robot.description", plan.robot.description),
        ("request.bounds", entry.bounds),
        ("request.options", entry.options),
    ):
        if value is None:
            reason = (
                "is missing: plans of version 1, and those made from messages, do not hold the "
                "whole request; plan the scenario again instead"
            )
            raise InvalidInput(field, None, reason)
    robot = Robot.load(parse_record(RobotDescription, plan.robot.description, "robot.description"))
    fields = entry
    names = {"seed": "request.seed"} if seed is None else {"seed": "seed"}
    if robustness is not None:
        fields = entry.model_copy(update={"robustness_threshold": robustness})
        names["robustness_threshold"] = "robustness_threshold"
    with naming_fields(names, "request."):
        request = PlanRequest.from_fields(
            fields,
            [limb.name for limb in robot.limbs],
            seed=entry.seed if seed is None else seed,
            options=read_options(entry.options or {}),
            stages=StageNames(guide=entry.stages.guide, contacts=entry.stages.contacts),
        )
    request = replace(
        request,
        start=_as_written(entry.start, request.start),
        goal=_as_written(entry.goal, request.goal),
        time_limit=TIME_LIMIT if request.time_limit is None else request.time_limit,
    )
    return PlanningInput(robot, plan.environment, request)


def _as_written(pose: Pose, placement: Placement) -> Placement:
    """A placement with the quaternion of the file, if that was normalised when it was written.

    Normalising it again may change its last digit, and with it the plan.
    """
    written = np.array(pose.orientation)
    exact = np.abs(written - placement.orientation).max() < ROUNDING
    return replace(placement, orientation=written) if exact else placement
