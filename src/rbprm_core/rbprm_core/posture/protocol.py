"""Interface of the posture stage: its problem, and its generator.

A witness posture of a transition has the geometry of the larger contact set and is in equilibrium
on the smaller one (Escande et al. 2013, section 4.2).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from rbprm_core.arrays import Array
from rbprm_core.body.state import State
from rbprm_core.body.whole_body import WholeBody
from rbprm_core.failures import Failure
from rbprm_core.posture.problem import PostureProblem
from rbprm_core.robot.data import RobotData
from rbprm_core.scene import Scene


class PostureGenerator(Protocol):
    """A posture generator for one robot in one scene."""

    def solve(self, problem: PostureProblem, start: Array) -> State | Failure:
        """A posture that satisfies a problem, or the failure of the search.

        The state has all contacts of the problem, the free ones where they were placed; its
        robustness is that on the supporting contacts.

        Args:
            problem: the problem.
            start: (nq,) configuration from which the search starts.
        """


@dataclass(frozen=True, eq=False)
class PostureSetting:
    """What a posture generator is made for.

    Attributes:
        data: the robot with its precomputed data.
        scene: the environment.
        body: whole-body queries of the robot in the scene.
        gravity: (3,) gravity in the planning frame, m/s^2.
    """

    data: RobotData
    scene: Scene
    body: WholeBody
    gravity: Array


@dataclass(frozen=True)
class PostureOptions:
    """Options of the posture generators.

    Attributes:
        margin: smallest distance between bodies, and between bodies and the environment, metres.
        max_steps: largest number of steps until the constraints are satisfied.
        criterion_steps: largest number of steps after that, for problems with a criterion.
        patience: number of steps in which the distance to the constraints must halve, or the
            search ends.
        max_step: largest change of a coordinate in one step, metres or radians.
        qp_solver: solver of the quadratic programs: daqp, osqp or proxqp.
    """

    margin: float = 1e-3
    max_steps: int = 16
    criterion_steps: int = 10
    patience: int = 4
    max_step: float = 0.3
    qp_solver: str = "daqp"


THOROUGH = PostureOptions(max_steps=50, patience=12)
"""Options for single problems, where time does not count."""

PostureGeneratorFactory = Callable[[PostureSetting, PostureOptions], PostureGenerator]
"""Makes a posture generator for one robot in one scene."""
