"""The first and the last state of a plan against its request."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pinocchio as pin

from rbprm_core.check.poses import pose_transform
from rbprm_core.check.violation import Kind, Violation
from rbprm_core.plan_record import ContactPlan, Pose

SLACK = 1e-9  # rounding of numbers that the planner compared with the same tolerance


def start_and_goal_violations(plan: ContactPlan) -> Iterator[Violation]:
    """Yield violations if the first root is not at the start, or the last one not at the goal.

    Args:
        plan: plan with at least one state.
    """
    last = len(plan.states) - 1
    yield from _root_violations(plan, 0, plan.request.start, Kind.START)
    yield from _root_violations(plan, last, plan.request.goal, Kind.GOAL)


def missing_goal_limbs(plan: ContactPlan) -> tuple[str, ...]:
    """Return the limbs that the request wants in contact in the last state and that are not.

    Args:
        plan: plan with its request.
    """
    in_contact = {contact.limb for state in plan.states[-1:] for contact in state.contacts}
    return tuple(limb for limb in plan.request.goal_limbs or () if limb not in in_contact)


def _root_violations(
    plan: ContactPlan, index: int, wanted: Pose, kind: Kind
) -> Iterator[Violation]:
    """Yield a violation if the root of a state is farther from a pose than the tolerances."""
    root = pose_transform(plan.states[index].root, f"states.{index}.root")
    goal = pose_transform(wanted, f"request.{kind}")
    distance = float(np.linalg.norm(root.translation - goal.translation))
    angle = float(np.linalg.norm(pin.log3(root.rotation.T @ goal.rotation)))
    request = plan.request
    far = distance > request.position_tolerance + SLACK
    turned = angle > request.orientation_tolerance + SLACK
    if far or turned:
        text = f"root {1e3 * distance:.2f} mm and {angle:.2g} rad from the {kind}"
        text += f" (at most {1e3 * request.position_tolerance:.2g} mm,"
        text += f" {request.orientation_tolerance:.2g} rad)"
        yield Violation(index, "", kind, text)
