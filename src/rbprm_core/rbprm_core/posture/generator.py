"""The posture generator: constraints of a problem, solved by sequential quadratic programming."""

from __future__ import annotations

from dataclasses import replace

from rbprm_core.arrays import Array
from rbprm_core.body.state import State
from rbprm_core.failures import Failure
from rbprm_core.posture.model import PostureModel
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
        self._model, self._margin = PostureModel(setting), options.margin
        self._criterion_steps = options.criterion_steps
        self._options = SqpOptions(
            max_steps=options.max_steps,
            max_step=options.max_step,
            patience=options.patience,
            qp_solver=options.qp_solver,
        )

    def solve(self, problem: PostureProblem, start: Array) -> State | Failure:
        """See `PostureGenerator.solve`."""
        program = PostureProgram(self._model, problem, start, self._margin)
        steps = 0 if problem.criterion is None else self._criterion_steps
        minimise(program, start, replace(self._options, criterion_steps=steps))
        return program.failure if program.accepted is None else program.accepted
