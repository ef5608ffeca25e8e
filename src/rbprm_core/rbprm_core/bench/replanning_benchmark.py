"""Walks during which the environment is edited: what each edit costs, and whether it ends well.

A walk plans a scenario with its seed, then plays the scenario's edits, each when its share of the
sequence's states has been executed. The clock starts when an edit is known, as surfaces, and stops
when the revised sequence is there. The check comes after that, on the states that are left to be
walked, in the environment as edited.
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
from rbprm_core.placement import Placement
from rbprm_core.plan_conversion.states_to_plan import contact_plan
from rbprm_core.plan_record import ContactPlan
from rbprm_core.planner import Outcome, plan
from rbprm_core.replanning.policy import Replan, Situation, Stuck, decide
from rbprm_core.replanning.replan import replan_from_one_of
from rbprm_core.replanning.validity import InvalidState, ValidityMonitor
from rbprm_core.request import PlanRequest
from rbprm_core.robot.data import RobotData
from rbprm_core.scenario import Scenario
from rbprm_core.scene import Scene


@dataclass(frozen=True, eq=False)
class PlayedEdit:
    """An edit and what came of it.

    Attributes:
        seed: of the walk. name: of the edit. executed: state that the robot was in.
        invalid: the states that did not hold any more, none where the plan stands.
        validity, replanning: seconds to find them, and to plan anew; 0 where nothing was planned.
        from_state: last state that was kept; -1 where nothing was planned.
        states: number of states of the sequence after it.
        failure: why there is no revision, "" where there is one or none is needed.
        violations: by the check of what is left to be walked.
        plan: what is left to be walked, in the environment as edited.
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
    def clean(self) -> bool:
        """True where the walk can go on."""
        return not self.failure and not self.violations

    @property
    def seconds(self) -> float:
        """From the edit to the revision, or to knowing that none is needed."""
        return self.validity + self.replanning


def replanning_benchmark(
    scenario: Scenario, data: RobotData, seed: int, edits: int, time_limit: float
) -> Iterator[PlayedEdit]:
    """Play a number of edits, walk after walk, each with the next seed and the scene as it was.

    Args:
        edits: number of edits. time_limit: of each planning, seconds.

    Raises:
        InvalidInput: a scenario without edits; an edit that cannot be used.
        RbprmError: the scenario itself cannot be planned.
    """
    if not scenario.edits:
        reason = "has no [[edits]]: rbprm scenarios lists those that have"
        raise InvalidInput("scenario", scenario.name, reason)
    left = edits
    for walk in count(seed):
        for played in _Walk(scenario, data, walk, time_limit).play():
            if left == 0:
                return
            left -= 1
            yield played


class _Walk:
    """One walk through a scenario."""

    def __init__(self, scenario: Scenario, data: RobotData, seed: int, time_limit: float) -> None:
        self._scenario, self._data = scenario, data
        self._seed, self._limit = seed, time_limit
        self._request = scenario.request_for(data.robot, seed)
        self._scene = scenario.scene()
        self._outcome = plan(self._request, data, self._scene, Budget(time_limit))
        self._states = self._outcome.states
        self._executed = 0

    def play(self) -> Iterator[PlayedEdit]:
        """The edits, until one leaves no way."""
        for k, edit in enumerate(self._scenario.edits):
            self._executed = max(self._executed, int(edit.at * len(self._states)))
            watch = self._watch()
            scene = self._scenario.edited(self._scene, k)
            start = time.perf_counter()
            invalid = watch.invalid(scene, self._executed)
            validity = time.perf_counter() - start
            self._scene = scene
            from_state, failure, replanning = self._react(invalid)
            rest = self._rest()
            yield PlayedEdit(
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
        """Do what the policy says: the state gone on from (-1), the failure (""), the seconds."""
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

    def _watch(self) -> ValidityMonitor:
        request = self._request
        least = request.min_robustness
        return ValidityMonitor(
            self._data, self._states, least, request.gravity, request.grip_force, self._scene
        )

    def _rest(self) -> ContactPlan:
        """What is left to be walked, as a plan of its own."""
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
    """Some last states of a sequence as a plan that starts where the first of them is."""
    root = ahead[0].q
    return contact_plan(
        replace(outcome, states=ahead),
        replace(request, start=Placement(root[:3], root[3:7])),
        data.robot,
        polygon_entry(scene, name),
    )
