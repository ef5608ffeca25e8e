"""The whole check: every bound, on every state and every pair of neighbouring states."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from rbprm_core.check.check_report import CheckReport
from rbprm_core.check.contact_changes import ContactTracker, repeated_limb_violations
from rbprm_core.check.contact_placement import friction_violations, placement_violations
from rbprm_core.check.kinematic_bounds import (
    com_violations,
    contact_point_violations,
    contact_pose_violations,
    joint_limit_violations,
    joint_order_violations,
)
from rbprm_core.check.patches import Patches
from rbprm_core.check.penetration import CollisionCheck
from rbprm_core.check.plan_environment import Environment
from rbprm_core.check.poses import plan_quaternion_violations, state_quaternion_violations
from rbprm_core.check.robot_model import Robot
from rbprm_core.check.start_and_goal import missing_goal_limbs, start_and_goal_violations
from rbprm_core.check.static_equilibrium import (
    force_closure_violations,
    robustness_violations,
    state_robustness,
    weight,
)
from rbprm_core.check.transition_support import SupportCounter, TransitionEnd
from rbprm_core.check.violation import PLAN, Kind, Violation
from rbprm_core.plan_record import ContactPlan, StateEntry


def check_plan(plan: ContactPlan) -> CheckReport:
    """Return the report of the check of a plan against every bound of the plan format.

    Args:
        plan: plan to check; the files that it names are read.

    Raises:
        InvalidInput: the plan cannot be checked, for example because a robot or mesh is missing or
            malformed, a frame is unknown, or the number of joint values is wrong. It names the
            field of the plan.
    """
    check = _Check(plan)
    violations = [*check.plan_violations()]
    for index, state in enumerate(plan.states):
        violations += check.state_violations(state, index)
    if plan.states:
        violations += start_and_goal_violations(plan)
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
        goal_missing=missing_goal_limbs(plan),
        support=check.support.total,
    )


class _Check:
    """Robot and environment of a plan, and values that accumulate from state to state."""

    def __init__(self, plan: ContactPlan) -> None:
        self.plan = plan
        self.robot = Robot(plan.robot)
        self.environment = Environment(plan.environment)
        self.collisions = CollisionCheck(self.robot, self.environment)
        self.weight = weight(self.robot.mass, plan.request.gravity)
        self.patches = Patches(self.environment)
        self.support = SupportCounter(self.weight, plan.request.grip_force)
        self.last: TransitionEnd | None = None
        self.tracker = ContactTracker()
        self.robustness: list[float] = []

    def plan_violations(self) -> Iterator[Violation]:
        """Yield the violations that belong to the whole plan."""
        if not self.plan.states:
            yield Violation(PLAN, "", Kind.NO_STATE, "has no state (at least 1)")
        yield from joint_order_violations(self.robot)
        yield from plan_quaternion_violations(self.plan)

    def state_violations(self, state: StateEntry, index: int) -> Iterator[Violation]:
        """Yield the violations of a state, and those between the last state and this one."""
        self.robot.place(state, index)
        yield from state_quaternion_violations(state, index)
        yield from repeated_limb_violations(state, index)
        yield from joint_limit_violations(self.robot, state, index)
        yield from com_violations(self.robot, state, index)
        for k, contact in enumerate(state.contacts):
            field = f"states.{index}.contacts.{k}"
            yield from contact_pose_violations(self.robot, contact, index, field)
            yield from contact_point_violations(contact, index)
            yield from self.collisions.contact_distance_violations(contact, index, field)
            yield from placement_violations(self.environment, contact, index)
            yield from friction_violations(self.environment, contact, index)
            yield from self.patches.violations(contact, index)
        yield from self.collisions.state_violations(state, index)
        yield from self._statics(state, index)
        yield from self._transition(state, index)

    def _transition(self, state: StateEntry, index: int) -> Iterator[Violation]:
        """Yield the violations between the last state and this one, and count their transition."""
        yield from self.tracker.step(state, index)
        end = TransitionEnd(state.contacts, self.robot.com)
        if self.last is not None and self.tracker.changed:
            self.support.add(self.last, end, self.tracker.changed)
        self.last = end

    def _statics(self, state: StateEntry, index: int) -> Iterator[Violation]:
        """Yield the violations of static equilibrium, and record the recomputed robustness."""
        request, weightless = self.plan.request, not np.any(self.weight)
        load = self.weight
        b0, fixed = state_robustness(state.contacts, self.robot.com, load, request.grip_force)
        self.robustness.append(b0)
        scale = request.grip_force if weightless else float(np.linalg.norm(load))
        if weightless:
            yield from force_closure_violations(b0, index, scale)
        threshold = request.robustness_threshold
        yield from robustness_violations(state, index, b0, fixed, threshold, scale)
