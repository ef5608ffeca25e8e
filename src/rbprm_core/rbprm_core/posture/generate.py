"""A single posture problem, from a robot and a scene to a state."""

from __future__ import annotations

import numpy as np

from rbprm_core.arrays import Array
from rbprm_core.body.state import State
from rbprm_core.body.whole_body import WholeBody
from rbprm_core.failures import Failure
from rbprm_core.posture.explanation import explained_failure
from rbprm_core.posture.problem import PostureProblem
from rbprm_core.posture.protocol import THOROUGH, PostureOptions, PostureSetting
from rbprm_core.posture.registry import POSTURE_GENERATORS
from rbprm_core.robot.data import RobotData
from rbprm_core.scene import Scene

GRAVITY = (0.0, 0.0, -9.81)


def posture_setting(
    data: RobotData, scene: Scene, gravity: Array | tuple[float, float, float] = GRAVITY
) -> PostureSetting:
    """What a posture generator is made for, without a planner around it.

    Args:
        data: the robot with its precomputed data.
        scene: the environment.
        gravity: (3,) gravity in the planning frame, m/s^2.
    """
    pull = np.asarray(gravity, dtype=float)
    return PostureSetting(data, scene, WholeBody(data, scene, pull, 0.0), pull)


def generate_posture(
    setting: PostureSetting,
    problem: PostureProblem,
    start: Array,
    options: PostureOptions = THOROUGH,
    generator: str = "sqp",
) -> State | Failure:
    """A posture that satisfies a problem, or the failure of the first constraint without one.

    Args:
        setting: robot, scene and gravity; see `posture_setting`.
        problem: the problem.
        start: (nq,) configuration from which the search starts.
        options: options of the generator.
        generator: name of the posture generator.

    Raises:
        InvalidInput: an unknown generator or solver.
    """
    solver = POSTURE_GENERATORS.get(generator, "generator")(setting, options)
    found = solver.solve(problem, start)
    if isinstance(found, Failure):
        return explained_failure(solver, problem, start, found)
    return found
