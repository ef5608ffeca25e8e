"""Validation of sequences in a process of its own."""

from __future__ import annotations

import uuid
from collections.abc import Callable

from rclpy.executors import Executor

from rbprm_core.plan_record import ContactPlan
from rbprm_core.replanning import InvalidState
from rbprm_ros.environment.store import Environment
from rbprm_ros.planning.sequence import PublishedSequence
from rbprm_ros.rclpy_utils.awaiting import outcome_of
from rbprm_ros.workers.jobs import RobotChoice, Validation
from rbprm_ros.workers.worker import PlanningWorker


def ignore(_: object) -> None:
    """Ignore a report."""


class Validator:
    """Validates sequences against the current environment; never waits for a plan.

    Args:
        worker: the process.
        environment: the environment.
        executor: returns the executor that runs the callbacks.
    """

    def __init__(
        self, worker: PlanningWorker, environment: Environment, executor: Callable[[], Executor]
    ) -> None:
        self._worker, self._environment, self._executor = worker, environment, executor

    async def validate(
        self, robot: RobotChoice, plan: ContactPlan, first: int
    ) -> tuple[InvalidState, ...]:
        """The invalid states of any sequence, from an index on.

        Args:
            robot: its robot.
            plan: its states, and the robustness threshold that they must reach.
            first: index of the first state to validate.

        Raises:
            RbprmError: the sequence cannot be used, or the process was lost.
        """
        min_robustness = plan.request.robustness_threshold
        return await self._result(
            self._validation(robot, uuid.uuid4().hex, plan, min_robustness, first)
        )

    async def validate_published(
        self, sequence: PublishedSequence, first: int
    ) -> tuple[InvalidState, ...]:
        """The invalid states of the published sequence, from an index on.

        Its states may be below the threshold where the request allows that.

        Args:
            sequence: the published sequence.
            first: index of the first state to validate.

        Raises:
            RbprmError: the process was lost.
        """
        return await self._result(self._validation_of(sequence, first))

    def prepare(self, sequence: PublishedSequence) -> None:
        """Validate a new sequence in advance.

        The process then holds the states, and their distances to obstacles, when surfaces change.

        Args:
            sequence: the published sequence.
        """
        self._worker.submit(self._validation_of(sequence, 0), ignore)

    async def _result(self, work: Validation) -> tuple[InvalidState, ...]:
        found = await outcome_of(self._worker.submit(work, ignore), self._executor())
        assert isinstance(found, tuple)
        return found

    def _validation_of(self, sequence: PublishedSequence, first: int) -> Validation:
        job = sequence.job
        min_robustness = job.request.min_robustness
        return self._validation(job.robot, sequence.key, sequence.plan, min_robustness, first)

    def _validation(
        self, robot: RobotChoice, key: str, plan: ContactPlan, min_robustness: float, first: int
    ) -> Validation:
        return Validation(
            uuid.uuid4().hex,
            robot,
            key,
            plan.states,
            min_robustness,
            plan.request.gravity,
            plan.request.grip_force,
            first,
            self._environment.snapshot,
        )
