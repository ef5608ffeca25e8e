"""The client of mission executives with a real planner, for both ways to spin its node."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from typing import TYPE_CHECKING

import pytest
from rbprm_msgs.msg import (
    ContactSequence,
    PlannerStatus,
    PlanningResult,
    PolygonRing,
    SurfaceArray,
)
from rbprm_msgs.srv import Plan, Replan, Validate
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from rbprm_ros.client import PlannerClient, PlannerTimeout

if TYPE_CHECKING:
    from conftest import Executive, Site

TIMEOUT = 60.0  # seconds, for actions that take less than one


@pytest.fixture(params=["in_a_thread", "while_it_waits"])
def client(request: pytest.FixtureRequest, shared: Site) -> Iterator[PlannerClient]:
    """A client whose node is spun in another thread, or by the client while it waits."""
    node = Node("operator", context=shared.context)
    executor = SingleThreadedExecutor(context=shared.context)
    executor.add_node(node)

    def spin_until(done: object, timeout: float) -> None:
        end = time.monotonic() + timeout
        while not done() and time.monotonic() < end:  # type: ignore[operator]
            executor.spin_once(0.02)

    thread = threading.Thread(target=executor.spin)
    if request.param == "in_a_thread":
        thread.start()
        yield PlannerClient(node)
    else:
        yield PlannerClient(node, spin_until=spin_until)
    executor.shutdown()
    if thread.ident is not None:
        thread.join()
    node.destroy_node()


def send(executive: Executive, client: PlannerClient, surfaces: SurfaceArray) -> None:
    """Send surfaces to the planner, and wait until it knows them."""
    client.wait_for_planner(TIMEOUT)
    executive.publish(surfaces)
    wanted = {(surface.id, len(surface.holes)) for surface in surfaces.surfaces}
    client.wait_until(
        lambda: (
            {
                (surface.id, len(surface.holes))
                for surface in client.environment().environment.surfaces
            }
            == wanted
        ),
        "surfaces taken in",
        TIMEOUT,
    )


def test_plan_feedback_result_and_what_is_watched(
    client: PlannerClient,
    executive: Executive,
    ground: SurfaceArray,
    request_on_ground: Plan.Request,
) -> None:
    sequences: list[ContactSequence] = []
    statuses: list[PlannerStatus] = []
    client.watch(sequences.append, statuses.append)
    send(executive, client, ground)
    call = client.plan(request_on_ground)
    result = call.result(TIMEOUT)
    assert result.result.code == PlanningResult.SUCCESS, result.result.text
    assert call.done
    assert call.feedback is not None
    assert call.feedback.stage in ("start", "guide", "shortcut", "sequence")
    assert call.cancel() is False
    identity = result.sequence.sequence_id
    client.wait_until(
        lambda: bool(statuses) and statuses[-1].sequence_id == identity, "its status", TIMEOUT
    )
    client.wait_until(
        lambda: bool(sequences) and sequences[-1].sequence_id == identity, "it", TIMEOUT
    )
    assert sequences[-1] == client.sequence == result.sequence
    assert client.status is not None
    assert client.status.state == PlannerStatus.VALID
    assert client.status.valid_states == len(result.sequence.states)
    # The planner reports the executed state, and replans from there.
    client.executed(result.sequence, 2)
    client.wait_until(lambda: statuses[-1].executed_state == 2, "the executed state", TIMEOUT)
    refused = client.replan(Replan.Request(from_state=1), TIMEOUT).result
    assert (refused.code, refused.field) == (PlanningResult.INVALID_INPUT, "from_state")
    revision = client.replan(Replan.Request(from_state=3), TIMEOUT)
    assert revision.result.code == PlanningResult.SUCCESS, revision.result.text
    assert (revision.sequence.revision, revision.sequence.first_changed_state) == (1, 4)
    assert revision.sequence.states[:4] == result.sequence.states[:4]


def test_validate_tells_which_states_do_not_hold(
    client: PlannerClient,
    executive: Executive,
    ground: SurfaceArray,
    request_on_ground: Plan.Request,
) -> None:
    send(executive, client, ground)
    sequence = client.plan(request_on_ground).result(TIMEOUT).sequence
    assert client.validate().valid
    # A hole under the end of the plan: the first states are valid, the last ones are not.
    corners = [(0.9, -1.0), (0.9, 1.0), (3.0, 1.0), (3.0, -1.0)]
    kind = type(ground.surfaces[0].vertices[0])
    ring = PolygonRing(vertices=[kind(x=x, y=y, z=0.0) for x, y in corners])
    ground.surfaces[0].holes.append(ring)
    send(executive, client, ground)
    found = client.validate(Validate.Request(sequence=sequence))
    assert found.result.code == PlanningResult.SUCCESS, found.result.text
    assert not found.valid
    lost = {state.index for state in found.invalid_states}
    feet = {
        state.index
        for state in sequence.states
        if any(contact.pose.position.x > 0.9 for contact in state.contacts)
    }
    assert lost == feet
    assert 0 not in lost


def test_cancel_ends_the_search(
    client: PlannerClient, executive: Executive, gap: SurfaceArray, request_over_gap: Plan.Request
) -> None:
    send(executive, client, gap)
    call = client.plan(request_over_gap)
    client.wait_until(lambda: call.feedback is not None, "feedback", TIMEOUT)
    assert not call.done
    with pytest.raises(PlannerTimeout, match=r"no result of the goal within 0\.1 s"):
        call.result(0.1)
    started = time.monotonic()
    assert call.cancel() is True
    result = call.result(TIMEOUT)
    assert time.monotonic() - started < 20.0  # the time limit of the request is 30 s
    assert result.result.code == PlanningResult.CANCELLED, result.result.text


def test_newer_goal_takes_the_place_of_the_older(
    client: PlannerClient, executive: Executive, gap: SurfaceArray, request_over_gap: Plan.Request
) -> None:
    send(executive, client, gap)
    goal = request_over_gap.goal.pose.position
    goal.x, far = 0.3, goal.x
    assert client.plan(request_over_gap).result(TIMEOUT).result.code == PlanningResult.SUCCESS
    goal.x = far
    first = client.plan(request_over_gap)
    client.wait_until(lambda: first.feedback is not None, "feedback", TIMEOUT)
    states: list[int] = []
    client.watch(on_status=lambda status: states.append(status.state))
    second = client.plan(request_over_gap)
    assert first.result(TIMEOUT).result.code == PlanningResult.PREEMPTED
    client.wait_until(lambda: second.feedback is not None, "feedback of the second", TIMEOUT)
    assert PlannerStatus.FAILED not in states
    assert client.status is not None
    assert client.status.state == PlannerStatus.PLANNING
    assert second.cancel()
    assert second.result(TIMEOUT).result.code == PlanningResult.CANCELLED
    # The earlier sequence is still published and valid.
    client.wait_until(lambda: states[-1:] == [PlannerStatus.VALID], "status VALID", TIMEOUT)


def test_planner_that_is_not_there_is_told(shared: Site) -> None:
    node = Node("operator", context=shared.context)
    client = PlannerClient(node, planner="/nobody")
    with pytest.raises(PlannerTimeout, match=r"planner /nobody; is it started.*no executor"):
        client.wait_for_planner(0.2)
    with pytest.raises(PlannerTimeout, match=r"action /nobody/plan_contacts within 0\.2 s"):
        client.plan(Plan.Request(), 0.2)
    with pytest.raises(PlannerTimeout, match="service /nobody/replan"):
        client.replan(Replan.Request(), 0.2)
    node.destroy_node()
