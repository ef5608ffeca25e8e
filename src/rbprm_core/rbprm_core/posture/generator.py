"""The posture generator: constraints of a problem, solved by sequential quadratic programming."""

from __future__ import annotations

import pinocchio as pin

from rbprm_core.arrays import Array
from rbprm_core.body.state import State
from rbprm_core.body.torques import TorqueModel
from rbprm_core.failures import Failure
from rbprm_core.posture.coordinates import Coordinates
from rbprm_core.posture.posture_program import PostureProgram
from rbprm_core.posture.problem import PostureProblem
from rbprm_core.posture.protocol import PostureOptions, PostureSetting
from rbprm_core.posture.sqp import SqpOptions, minimise


class SqpPostureGenerator:
    """Solves posture problems from a start configuration. Not thread-safe: it holds scratch data.

    Args:
        setting: robot and scene.
        options: options of the generator.
    """

    def __init__(
        self,
        setting: PostureSetting,
        options: PostureOptions = PostureOptions(),  # noqa: B008 (frozen)
    ) -> None:
        self._setting, self._options = setting, options
        robot = setting.body.robot
        self._coordinates = Coordinates(robot)
        self._torques = TorqueModel(robot, setting.gravity)
        self._data: pin.Data = robot.model.createData()

    def solve(self, problem: PostureProblem, start: Array) -> State | Failure:
        """See `PostureGenerator.solve`."""
        program = PostureProgram(
            self._setting,
            self._options,
            problem,
            start,
            self._coordinates,
            self._torques,
            self._data,
        )
        options = SqpOptions(
            max_steps=self._options.max_steps,
            criterion_steps=self._options.criterion_steps,
            qp_solver=self._options.qp_solver,
        )
        found = minimise(program, start, options)
        return program.state(found.point) if found.solved else program.failure
