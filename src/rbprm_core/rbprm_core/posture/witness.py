"""Witness postures of transitions, as posture problems (Escande et al. 2013, section 4.2)."""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum

from rbprm_core.arrays import Array
from rbprm_core.body.transition import Action, Transition
from rbprm_core.errors import InvalidInput
from rbprm_core.posture.constraints.rows import Constraint
from rbprm_core.posture.problem import PostureProblem


class WitnessEnd(StrEnum):
    """The ends of a transition: the moving limb leaves its contact, and reaches the next one."""

    LIFT_OFF = "lift-off"
    TOUCH_DOWN = "touch-down"


ENDS = {
    Action.NONE: (),
    Action.MAKE: (WitnessEnd.TOUCH_DOWN,),
    Action.BREAK: (WitnessEnd.LIFT_OFF,),
    Action.MOVE: (WitnessEnd.LIFT_OFF, WitnessEnd.TOUCH_DOWN),
}
"""The ends that a transition has, by its action."""


def witness_problem(
    transition: Transition,
    end: WitnessEnd,
    min_robustness: float,
    max_torque_ratio: float | None = None,
    tasks: Sequence[Constraint] = (),
) -> tuple[PostureProblem, Array]:
    """The problem of a witness posture: all contacts of one end, equilibrium on those that stay.

    Args:
        transition: the transition.
        end: the end of the transition.
        min_robustness: smallest raw b0 on the contacts that stay, newtons.
        max_torque_ratio: largest share of a joint's effort limit, None where torques do not count.
        tasks: further constraints.

    Returns:
        The problem, and the planned configuration (nq,) of that end, from which to start.

    Raises:
        InvalidInput: the transition has no such end.
    """
    ends = ENDS[transition.action]
    if end not in ends:
        known = " and ".join(ends) if ends else "neither"
        reason = f"the transition does not have it ({transition.action}): it has {known}"
        raise InvalidInput("end", str(end), reason)
    state = transition.before if end is WitnessEnd.LIFT_OFF else transition.after
    problem = PostureProblem(
        contacts=state.contacts,
        supporting=transition.shared_contacts,
        min_robustness=min_robustness,
        max_torque_ratio=max_torque_ratio,
        tasks=tuple(tasks),
    )
    return problem, state.q
