"""The node with a lifecycle manager, and without one."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest
from lifecycle_msgs.msg import State, Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rbprm_msgs.action import PlanContacts
from rbprm_msgs.msg import PlannerStatus, PlanningResult, SurfaceArray
from rbprm_msgs.srv import Plan, Replan, Validate
from rclpy.action import ActionClient

if TYPE_CHECKING:
    from conftest import Executive, Site

ACTION = "/rbprm_planner/plan_contacts"


def state(executive: Executive) -> int:
    """The node's lifecycle state."""
    return int(executive.ask(GetState, "get_state", GetState.Request()).current_state.id)


def change(executive: Executive, transition: int) -> bool:
    """Request a transition; returns whether it took place."""
    request = ChangeState.Request(transition=Transition(id=transition))
    return bool(executive.ask(ChangeState, "change_state", request).success)


def start_goal(executive: Executive) -> Any:
    """Send an empty goal; returns the future of its result."""
    client = ActionClient(executive.node, PlanContacts, ACTION)
    executive.reach(client, client.server_is_ready, "the action")
    sent = client.send_goal_async(PlanContacts.Goal())
    executive.spin_until(sent.done, "an accepted goal")
    return sent.result().get_result_async()


def codes(executive: Executive) -> set[int]:
    """The codes with which the planning interfaces answer empty requests."""
    goal = start_goal(executive)
    executive.spin_until(goal.done, "a result")
    kinds = ((Plan, "plan"), (Replan, "replan"), (Validate, "validate"))
    answers = [executive.ask(kind, name, kind.Request()) for kind, name in kinds]
    return {goal.result().result.result.code, *(answer.result.code for answer in answers)}


@pytest.fixture
def unconfigured(managed: Site) -> Executive:
    """A client of the managed planner, which is not configured."""
    executive = managed.executive()
    if state(executive) == State.PRIMARY_STATE_ACTIVE:
        assert change(executive, Transition.TRANSITION_DEACTIVATE)
    if state(executive) == State.PRIMARY_STATE_INACTIVE:
        assert change(executive, Transition.TRANSITION_CLEANUP)
    return executive


@pytest.fixture
def activated(unconfigured: Executive) -> Executive:
    """A client of the managed planner, which was configured and activated."""
    assert change(unconfigured, Transition.TRANSITION_CONFIGURE)
    assert change(unconfigured, Transition.TRANSITION_ACTIVATE)
    unconfigured.listen()
    return unconfigured


def test_alone_it_comes_up_active(site: Site) -> None:
    site.planner()
    executive = site.executive()
    assert state(executive) == State.PRIMARY_STATE_ACTIVE
    assert PlanningResult.NOT_ACTIVE not in codes(executive)


def test_calls_before_activation_are_refused(
    managed: Site, unconfigured: Executive, ground: SurfaceArray
) -> None:
    executive, planner = unconfigured, managed.processes[0]
    assert state(executive) == State.PRIMARY_STATE_UNCONFIGURED
    assert planner.children() == []
    assert codes(executive) == {PlanningResult.NOT_ACTIVE}
    # Surfaces are accepted all the same, so that they need not be published again.
    executive.publish(ground)
    executive.spin_until(lambda: len(executive.known()) == 1, "the ground")
    assert change(executive, Transition.TRANSITION_CONFIGURE)
    assert state(executive) == State.PRIMARY_STATE_INACTIVE
    assert codes(executive) == {PlanningResult.NOT_ACTIVE}
    assert change(executive, Transition.TRANSITION_ACTIVATE)
    assert state(executive) == State.PRIMARY_STATE_ACTIVE
    assert PlanningResult.NOT_ACTIVE not in codes(executive)


def test_impossible_transition_is_refused_and_changes_nothing(unconfigured: Executive) -> None:
    for transition in (Transition.TRANSITION_ACTIVATE, Transition.TRANSITION_CLEANUP, 99, 255):
        assert not change(unconfigured, transition)
    assert state(unconfigured) == State.PRIMARY_STATE_UNCONFIGURED


def test_deactivation_cancels_what_is_planned(
    managed: Site, activated: Executive, gap: SurfaceArray, request_over_gap: Plan.Request
) -> None:
    executive, planner = activated, managed.processes[0]
    executive.publish(gap)
    executive.spin_until(lambda: len(executive.known()) == 2, "the surfaces")
    call = executive.start_call(request_over_gap)
    executive.spin_until(lambda: "guide 0%" in planner.log.read_text(), "search")
    waiting = executive.start_call(request_over_gap)
    executive.known()  # the call has arrived before this one is answered
    assert change(executive, Transition.TRANSITION_DEACTIVATE)
    assert executive.answer(call, 20.0).result.code == PlanningResult.CANCELLED
    assert executive.answer(waiting, 20.0).result.code == PlanningResult.CANCELLED
    assert codes(executive) == {PlanningResult.NOT_ACTIVE}
    assert change(executive, Transition.TRANSITION_ACTIVATE)
    request_over_gap.goal.pose.position.x = 0.2
    assert executive.call(request_over_gap).result.code == PlanningResult.SUCCESS


def test_deactivation_ends_replanning_too(
    activated: Executive, ground: SurfaceArray, gap: SurfaceArray, request_on_ground: Plan.Request
) -> None:
    """The published sequence stays, and is replanned once the node is active again."""
    statuses = activated.statuses
    activated.publish(ground)
    activated.spin_until(lambda: len(activated.known()) == 1, "the ground")
    request_on_ground.goal.pose.position.x = 4.5
    assert activated.call(request_on_ground).result.code == PlanningResult.SUCCESS
    activated.publish(gap)
    activated.spin_until(lambda: statuses[-1].state == PlannerStatus.REPLANNING, "replanning")
    assert change(activated, Transition.TRANSITION_DEACTIVATE)
    activated.spin_until(lambda: statuses[-1].state == PlannerStatus.IDLE, "its end")
    assert statuses[-1].revision == 0
    assert statuses[-1].invalid_states  # as they were at the last validation
    count = len(statuses)
    assert change(activated, Transition.TRANSITION_ACTIVATE)
    activated.spin_until(
        lambda: any(s.state == PlannerStatus.REPLANNING for s in statuses[count:]),
        "replanning again",
    )


def test_nothing_is_said_to_hold_while_nobody_looks(
    activated: Executive, ground: SurfaceArray, gap: SurfaceArray, request_on_ground: Plan.Request
) -> None:
    statuses = activated.statuses
    activated.publish(ground)
    activated.spin_until(lambda: len(activated.known()) == 1, "the ground")
    request_on_ground.goal.pose.position.x = 4.5
    assert activated.call(request_on_ground).result.code == PlanningResult.SUCCESS
    activated.spin_until(lambda: statuses[-1].state == PlannerStatus.VALID, "status VALID")
    known = statuses[-1].environment_version
    assert change(activated, Transition.TRANSITION_DEACTIVATE)
    activated.publish(gap)
    activated.spin_until(lambda: len(activated.known()) == 2, "the gap")
    assert (statuses[-1].state, statuses[-1].environment_version) == (PlannerStatus.IDLE, known)
    count = len(statuses)
    assert change(activated, Transition.TRANSITION_ACTIVATE)
    activated.spin_until(
        lambda: any(s.state == PlannerStatus.INVALIDATED for s in statuses[count:]), "a look"
    )
    assert PlannerStatus.VALID not in {status.state for status in statuses[count:]}


def test_cleanup_forgets(
    managed: Site, activated: Executive, ground: SurfaceArray, request_on_ground: Plan.Request
) -> None:
    activated.publish(ground)
    activated.spin_until(lambda: len(activated.known()) == 1, "the ground")
    request_on_ground.goal.pose.position.x = 0.2
    assert activated.call(request_on_ground).result.code == PlanningResult.SUCCESS
    activated.spin_until(lambda: activated.statuses[-1].sequence_id != "", "a sequence")
    assert change(activated, Transition.TRANSITION_DEACTIVATE)
    assert change(activated, Transition.TRANSITION_CLEANUP)
    assert managed.processes[0].children() == []
    late = managed.executive()
    late.listen()
    late.spin_until(lambda: late.sequences and late.guides and late.statuses, "latched messages")
    assert not late.sequences[-1].states
    assert not late.guides[-1].poses
    status = late.statuses[-1]
    assert (status.state, status.sequence_id) == (PlannerStatus.IDLE, "")
    assert len(activated.known()) == 0
    assert change(activated, Transition.TRANSITION_CONFIGURE)
    assert change(activated, Transition.TRANSITION_ACTIVATE)
    assert activated.call(request_on_ground).result.field == "surfaces"
