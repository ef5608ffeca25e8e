"""The whole check: every bound, on every state and every pair of neighbours."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from rbprm_core.check.collision import Collisions
from rbprm_core.check.environment import (
    Environment,
    contact_friction,
    contact_on_environment,
)
from rbprm_core.check.kinematics import (
    Robot,
    centre_of_mass,
    contact_points,
    contact_pose,
    joint_limits,
    joint_order,
)
from rbprm_core.check.patches import Patches
from rbprm_core.check.poses import plan_quaternions, state_quaternions
from rbprm_core.check.report import PLAN, CheckReport, Kind, Violation
from rbprm_core.check.sequence import Tracker, ends, limbs_once, missing_at_goal
from rbprm_core.check.statics import force_closure, state_robustness, statics, weight
from rbprm_core.check.support import End, SupportCount
from rbprm_core.plan_record import ContactPlan, StateEntry


def check_plan(plan: ContactPlan) -> CheckReport:
    """Hold a plan against every bound of the plan file's description.

    Raises:
        InvalidInput: the plan cannot be evaluated: a missing or malformed robot or mesh, an unknown
            frame, a wrong number of joint values; names the field.
    """
    check = _Check(plan)
    violations = [*check.plan_violations()]
    for index, state in enumerate(plan.states):
        violations += check.state_violations(state, index)
    if plan.states:
        violations += ends(plan)
    violations.sort(key=lambda violation: violation.state)
    return CheckReport(
        violations=tuple(violations),
        states=len(plan.states),
        transitions=check.tracker.transitions,
        robustness=tuple(check.robustness),
        deepest_collision=check.collisions.deepest,
        overhanging=check.patches.overhanging,
        unsupported=check.patches.unsupported,
        goal_limbs=plan.request.goal_limbs,
        goal_missing=missing_at_goal(plan),
        support=check.support.total,
    )


class _Check:
    """What is loaded once for a plan, and what is carried from state to state."""

    def __init__(self, plan: ContactPlan) -> None:
        self.plan = plan
        self.robot = Robot(plan.robot)
        self.environment = Environment(plan.environment)
        self.collisions = Collisions(self.robot, self.environment)
        self.weight = weight(self.robot.mass, plan.request.gravity)
        self.patches = Patches(self.environment)
        self.support = SupportCount(self.weight, plan.request.grip_force)
        self.last: End | None = None
        self.tracker = Tracker()
        self.robustness: list[float] = []

    def plan_violations(self) -> Iterator[Violation]:
        """Violations that belong to no state."""
        if not self.plan.states:
            yield Violation(PLAN, "", Kind.NO_STATE, "has no state (at least 1)")
        yield from joint_order(self.robot)
        yield from plan_quaternions(self.plan)

    def state_violations(self, state: StateEntry, index: int) -> Iterator[Violation]:
        """Violations of a state, and of the pair that it forms with the last one."""
        self.robot.place(state, index)
        yield from state_quaternions(state, index)
        yield from limbs_once(state, index)
        yield from joint_limits(self.robot, state, index)
        yield from centre_of_mass(self.robot, state, index)
        for k, contact in enumerate(state.contacts):
            field = f"states.{index}.contacts.{k}"
            yield from contact_pose(self.robot, contact, index, field)
            yield from contact_points(contact, index)
            yield from self.collisions.reach_violations(contact, index, field)
            yield from contact_on_environment(self.environment, contact, index)
            yield from contact_friction(self.environment, contact, index)
            yield from self.patches.violations(contact, index)
        yield from self.collisions.state_violations(state, index)
        yield from self._statics(state, index)
        yield from self._transition(state, index)

    def _transition(self, state: StateEntry, index: int) -> Iterator[Violation]:
        yield from self.tracker.step(state, index)
        end = End(state.contacts, self.robot.com)
        if self.last is not None and self.tracker.changed:
            self.support.add(self.last, end, self.tracker.changed)
        self.last = end

    def _statics(self, state: StateEntry, index: int) -> Iterator[Violation]:
        request, weightless = self.plan.request, not np.any(self.weight)
        load = self.weight
        b0, fixed = state_robustness(state.contacts, self.robot.com, load, request.grip_force)
        self.robustness.append(b0)
        scale = request.grip_force if weightless else float(np.linalg.norm(load))
        if weightless:
            yield from force_closure(b0, index, scale)
        yield from statics(state, index, b0, fixed, request.robustness_threshold, scale)
