"""The planner's status as messages."""

from __future__ import annotations

from collections.abc import Iterable

from rbprm_msgs.msg import InvalidState as InvalidStateMessage
from rbprm_msgs.msg import PlannerStatus as PlannerStatusMessage
from std_msgs.msg import Header

from rbprm_core.replanning import InvalidState
from rbprm_ros.conversions.geometry import time_message
from rbprm_ros.conversions.results import result_message
from rbprm_ros.planning.sequence import PublishedSequence
from rbprm_ros.planning.status import PlannerStatus


def status_message(
    header: Header, status: PlannerStatus, sequence: PublishedSequence | None
) -> PlannerStatusMessage:
    """The message of a status.

    Args:
        header: header of the message.
        status: the status.
        sequence: the published sequence; None where there is none.
    """
    states = 0 if sequence is None else len(sequence.plan.states)
    return PlannerStatusMessage(
        header=header,
        state=int(status.activity),
        sequence_id="" if sequence is None else sequence.id,
        revision=0 if sequence is None else sequence.revision,
        valid_states=min((state.index for state in status.invalid), default=states),
        invalid_states=invalid_state_messages(status.invalid),
        executed_state=status.executed,
        environment_version=status.environment_version,
        surfaces_stamp=time_message(status.surfaces_stamp),
        result=result_message(status.error),
    )


def invalid_state_messages(states: Iterable[InvalidState]) -> list[InvalidStateMessage]:
    """The messages of invalid states.

    Args:
        states: the invalid states.
    """
    return [
        InvalidStateMessage(
            index=state.index,
            reason=int(state.reason),
            cause=int(state.failure.cause),
            limb=state.limb,
            surface_id=state.surface,
            text=state.text,
        )
        for state in states
    ]
