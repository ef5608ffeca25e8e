"""Benchmark of replanning: simulated executions during which the environment is edited.

An execution plans a scenario with a seed, then applies the scenario's edits, each when the edit's
share of the sequence's states has been executed. The time of a replan runs from the moment that the
edited surfaces are known until the revised sequence exists. After that, the remaining states are
checked in the edited environment.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import count

from rbprm_core.body.state import State
from rbprm_core.budget import Budget
from rbprm_core.check import check_plan
from rbprm_core.environment import polygon_entry
from rbprm_core.errors import InvalidInput, RbprmError
from rbprm_core.outcome import Outcome
from rbprm_core.placement import Placement
from rbprm_core.plan_conversion.states_to_plan import contact_plan
from rbprm_core.plan_record import ContactPlan
from rbprm_core.planner import plan
from rbprm_core.replanning.policy import Replan, Situation, Stuck, decide
from rbprm_core.replanning.replan import replan_from_one_of
from rbprm_core.replanning.validity import InvalidState, ValidityMonitor
from rbprm_core.request import PlanRequest
from rbprm_core.robot.data import RobotData
from rbprm_core.scenario import Scenario
from rbprm_core.scene import Scene


@dataclass(frozen=True, eq=False)
class AppliedEdit:
    """An edit of the environment and its consequences for the sequence.

    Attributes:
        seed: seed of the execution.
        name: name of the edit.
        executed: index of the state that the robot was in.
        invalid: states ahead that are invalid after the edit; empty where the plan is kept.
        validity: time to find the invalid states, seconds.
        replanning: time to replan, seconds; 0 where the plan was kept.
        from_state: index of the last state that was kept in a replan; -1 where none was made.
        states: number of states of the sequence afterwards.
        failure: reason why the sequence could not be revised; "" where it was, or was kept.
        violations: violations found by the check of the remaining sequence.
        plan: the remaining sequence as a plan in the edited environment.
    """

    seed: int
    name: str
    executed: int
    invalid: tuple[InvalidState, ...]
    validity: float
    replanning: float
    from_state: int
    states: int
    failure: str
    violations: tuple[str, ...]
    plan: ContactPlan

    @property
    def valid(self) -> bool:
        """True where a remaining sequence exists and the check finds no violation."""
        return not self.failure and not self.violations

    @property
    def seconds(self) -> float:
        """Time from the edit to the revised sequence, or to the decision to keep it, seconds."""
        return self.validity + self.replanning


def replanning_benchmark(
    scenario: Scenario, data: RobotData, seed: int, edits: int, time_limit: float
) -> Iterator[AppliedEdit]:
    """Apply a number of edits, in as many executions as needed.

    Each execution has the next seed and starts in the scenario's own environment.

    Args:
        scenario: a scenario with edits.
        data: data of the robot.
        seed: seed of the first execution.
        edits: number of edits.
        time_limit: time limit of the first plan and of each replan, seconds.

    Yields:
        Each applied edit.

    Raises:
        InvalidInput: a scenario without edits, or an edit that cannot be used.
        RbprmError: the scenario cannot be planned before any edit.
    """
    if not scenario.edits:
        raise InvalidInput("scenario", scenario.name, "its file has no [[edits]]")
    left = edits
    for execution_seed in count(seed):
        for applied in _Execution(scenario, data, execution_seed, time_limit).run():
            if left == 0:
                return
            left -= 1
            yield applied


class _Execution:
    """One simulated execution of a scenario."""

    def __init__(self, scenario: Scenario, data: RobotData, seed: int, time_limit: float) -> None:
        self._scenario, self._data = scenario, data
        self._seed, self._limit = seed, time_limit
        self._request = scenario.request_for(data.robot, seed)
        self._scene = scenario.scene()
        self._outcome = plan(self._request, data, self._scene, Budget(time_limit))
        self._states = self._outcome.states
        self._executed = 0

    def run(self) -> Iterator[AppliedEdit]:
        """Apply the edits in turn; the last one yielded is the first that cannot be handled."""
        for k, edit in enumerate(self._scenario.edits):
            self._executed = max(self._executed, int(edit.at * len(self._states)))
            monitor = self._monitor()
            scene = self._scenario.edited(self._scene, k)
            start = time.perf_counter()
            invalid = monitor.invalid(scene, self._executed)
            validity = time.perf_counter() - start
            self._scene = scene
            from_state, failure, replanning = self._react(invalid)
            rest = self._rest()
            yield AppliedEdit(
                seed=self._seed,
                name=edit.name,
                executed=self._executed,
                invalid=invalid,
                validity=validity,
                replanning=replanning,
                from_state=from_state,
                states=len(self._states),
                failure=failure,
                violations=tuple(str(v) for v in check_plan(rest).violations),
                plan=rest,
            )
            if failure:
                return

    def _react(self, invalid: tuple[InvalidState, ...]) -> tuple[int, str, float]:
        """Keep the sequence or replan, as the policy decides.

        Returns:
            Index of the last state that was kept in a replan (-1 without), reason of a failure
            ("" without), and time of the replan, seconds.
        """
        indices = tuple(found.index for found in invalid)
        decision = decide(Situation(len(self._states), self._executed, indices))
        if isinstance(decision, Stuck):
            return -1, decision.reason, 0.0
        if not isinstance(decision, Replan):
            return -1, "", 0.0
        start = time.perf_counter()
        try:
            revision = replan_from_one_of(
                self._states, decision.candidates, self._request, self._data, self._scene,
                Budget(self._limit),
            )  # fmt: skip
        except RbprmError as error:
            self._states = self._states[: indices[0]]
            return -1, str(error), time.perf_counter() - start
        self._states, self._outcome = revision.states, revision.outcome
        return revision.first_changed - 1, "", time.perf_counter() - start

    def _monitor(self) -> ValidityMonitor:
        """A monitor of the sequence in the present scene."""
        request = self._request
        return ValidityMonitor(
            self._data,
            self._states,
            request.min_robustness,
            request.gravity,
            request.grip_force,
            self._scene,
        )

    def _rest(self) -> ContactPlan:
        """The remaining sequence as a plan of its own."""
        ahead = self._states[self._executed :]
        return rest_of_plan(
            self._outcome, ahead, self._request, self._data, self._scene, self._scenario.name
        )


def rest_of_plan(
    outcome: Outcome,
    ahead: tuple[State, ...],
    request: PlanRequest,
    data: RobotData,
    scene: Scene,
    name: str,
) -> ContactPlan:
    """The plan of the last states of a sequence, which starts at the first of them.

    Args:
        outcome: result of planning the whole sequence.
        ahead: the last states, the executed one first.
        request: request of the whole sequence.
        data: data of the robot.
        scene: the present scene.
        name: name of the environment.
    """
    root = ahead[0].q
    return contact_plan(
        replace(outcome, states=ahead),
        replace(request, start=Placement(root[:3], root[3:7])),
        data.robot,
        polygon_entry(scene, name),
    )
