"""How the planner stands, as messages."""

from __future__ import annotations

from collections.abc import Iterable

from rbprm_msgs.msg import InvalidState as InvalidStateMessage
from rbprm_msgs.msg import PlannerStatus
from std_msgs.msg import Header

from rbprm_core.replanning import InvalidState
from rbprm_ros.conversions.geometry import time_message
from rbprm_ros.conversions.results import result_message
from rbprm_ros.planning.published import Published, Standing


def status_message(
    header: Header, standing: Standing, published: Published | None
) -> PlannerStatus:
    """The status of now."""
    states = 0 if published is None else len(published.plan.states)
    return PlannerStatus(
        header=header,
        state=int(standing.activity),
        sequence_id="" if published is None else published.id,
        revision=0 if published is None else published.revision,
        valid_states=min((state.index for state in standing.invalid), default=states),
        invalid_states=invalid_state_messages(standing.invalid),
        executed_state=standing.executed,
        environment_version=standing.environment_version,
        surfaces_stamp=time_message(standing.surfaces_stamp),
        result=result_message(standing.failure),
    )


def invalid_state_messages(states: Iterable[InvalidState]) -> list[InvalidStateMessage]:
    """States that do not hold."""
    return [
        InvalidStateMessage(
            index=state.index,
            reason=int(state.reason),
            limb=state.limb,
            surface_id=state.surface,
            text=state.text,
        )
        for state in states
    ]
