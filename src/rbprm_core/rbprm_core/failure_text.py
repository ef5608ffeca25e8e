"""Texts of failures: what happened, and what to change about it. The only place that has them."""

from __future__ import annotations

from rbprm_core.failures import Cause, Failure

TEXTS: dict[Cause, str] = {
    Cause.UNSPECIFIED: "no cause is known",
    Cause.TRUNK_IN_OBSTACLE: "the trunk is inside an obstacle",
    Cause.TRUNK_COLLISION: "the trunk, scaled by {scale:g}, collides with the environment",
    Cause.NO_SURFACE_OF_KIND: "the environment has no {kinds} surface for limb {limb}",
    Cause.NO_SURFACE_IN_WORKSPACE: "no {kinds} surface in the workspace of limb {limb}",
    Cause.WEIGHT_UNSUPPORTED: (
        "no contacts within the limbs' workspaces can support the robot's weight"
    ),
    Cause.ROOT_COLLISION: "the root part of the robot collides with the environment",
    Cause.LIMB_COLLISION: "limb {limb} is in collision",
    Cause.REFERENCE_POSTURE_COLLISION: "limb {limb}, in its reference posture, is in collision",
    Cause.LOW_ROBUSTNESS: "robustness {robustness:.3g} N under {threshold:g} N",
    Cause.SURFACE_LOST: (
        "no surface supports the contact of limb {limb} at ({x:.3f}, {y:.3f}, {z:.3f}) m"
    ),
    Cause.BODY_COLLISION: "body {body} collides with the environment",
    Cause.NO_START_LIMBS: "no limb is requested to be in contact",
    Cause.CONTACT_NOT_REACHED: "limb {limb} stays {distance:.2g} m away from its contact",
    Cause.SELF_COLLISION: "bodies {body} collide",
    Cause.TORQUE_LIMIT: "joint {body} needs {ratio:.2f} of its effort limit, {limit:g} is allowed",
    Cause.TASK_NOT_MET: "task {body} is violated by {violation:.2g}",
    Cause.NO_CANDIDATE: "limb {limb} finds no contact (no candidate near a surface)",
    Cause.NO_KINEMATIC_SOLUTION: "limb {limb} finds no contact (kinematics)",
    Cause.NO_EQUILIBRIUM: "limb {limb} finds no contact (equilibrium)",
    Cause.SECOND_CONTACT_OUT_OF_REACH: "a second contact leaves the reach of limb {limb}",
    Cause.SECOND_CONTACT_COLLISION: "a second contact, of limb {limb}, is lost to a collision",
    Cause.NO_FREE_POSTURE: "limb {limb} finds no posture free of collision",
    Cause.TREES_NOT_CONNECTED: (
        "{samples:.0f} samples did not connect start and goal; {start_nodes:.0f} nodes were "
        "reached from the start, {goal_nodes:.0f} from the goal"
    ),
    Cause.ROADMAP_NOT_CONNECTED: (
        "{samples:.0f} samples did not connect start and goal; the roadmap has {nodes:.0f} nodes "
        "in {parts:.0f} parts"
    ),
    Cause.NO_VALID_PATH: "none of {tried:.0f} paths from start to goal is valid",
    Cause.EXECUTED_STATE_INVALID: "state {state:.0f}, which the robot is in, is invalid",
    Cause.PROCESS_DIED: "the planning process ended without an answer",
}
"""What happened, by cause; the fields and figures of the failure are filled in."""

_EQUILIBRIUM = "lower the robustness threshold, move the root, or put other limbs in contact"
_COLLISION = "move the root away from what it collides with"
_REACH = "move the root, put fewer limbs in contact, or send more surfaces"

ROOT_REMEDIES: dict[Cause, str] = {
    Cause.TRUNK_IN_OBSTACLE: "move the root out of it",
    Cause.TRUNK_COLLISION: _COLLISION,
    Cause.ROOT_COLLISION: _COLLISION,
    Cause.LIMB_COLLISION: _COLLISION,
    Cause.REFERENCE_POSTURE_COLLISION: _COLLISION,
    Cause.WEIGHT_UNSUPPORTED: "move the root, or require more limbs",
    Cause.LOW_ROBUSTNESS: _EQUILIBRIUM,
    Cause.NO_EQUILIBRIUM: _EQUILIBRIUM,
    Cause.SURFACE_LOST: "start from a state whose contacts are supported, or send their surfaces",
    Cause.NO_START_LIMBS: "name limbs in contact",
    Cause.EXECUTED_STATE_INVALID: "plan from a measured state",
}
"""What to change about a start or goal that is not reachable; `_REACH` for the other causes."""

_WEAK = "lower the robustness threshold, or try another seed or more guides"
SEQUENCE_REMEDIES: dict[Cause, str] = {
    Cause.LOW_ROBUSTNESS: _WEAK,
    Cause.NO_EQUILIBRIUM: _WEAK,
}
"""What to change about a sequence that stopped."""

GUIDE_REMEDY = "widen the root bounds, require fewer limbs, or raise the iterations"


def failure_text(failure: Failure) -> str:
    """What happened, in one phrase without a full stop.

    Args:
        failure: the failure.
    """
    fields = {
        "limb": failure.limb,
        "surface": failure.surface,
        "body": failure.body,
        "kinds": " or ".join(failure.kinds),
    }
    return TEXTS[failure.cause].format(**fields, **dict(failure.figures))


def root_remedy(failure: Failure) -> str:
    """What to change about a start or goal that is not reachable.

    Args:
        failure: why the root placement admits no contact state.
    """
    return ROOT_REMEDIES.get(failure.cause, _REACH)


def sequence_remedy(failure: Failure) -> str:
    """What to change about a contact sequence that stopped before the goal.

    Args:
        failure: why it stopped.
    """
    return SEQUENCE_REMEDIES.get(
        failure.cause, "try another seed, more guides, or a smaller sequence.min_step"
    )
