"""Peers of the planner die, hang, or exist twice."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from typing import TYPE_CHECKING

import pytest
from rbprm_msgs.action import PlanContacts
from rbprm_msgs.msg import ExecutionState, PlannerStatus, PlanningResult, SurfaceArray
from rbprm_msgs.srv import GetEnvironment, Plan, Replan, Validate
from rclpy.serialization import serialize_message

from rbprm_ros.client import PlannerClient
from rbprm_ros.rclpy_utils.qos import CALLS

if TYPE_CHECKING:
    from conftest import Executive, Site

NODE = "/rbprm_planner"
SEND_A_GOAL = """
import sys
from rbprm_msgs.action import PlanContacts
from rclpy.node import Node
from rclpy.serialization import deserialize_message
from rbprm_ros.client import PlannerClient
from rbprm_ros.rclpy_utils.spinning import Spinner, init
init()
node = Node("doomed")
goal = deserialize_message(bytes.fromhex(sys.argv[1]), PlanContacts.Goal)
client = PlannerClient(node, spin_until=Spinner(node).spin_until)
client.wait_for_planner(20.0)
call = client.plan(goal)
client.wait_until(lambda: call.feedback is not None, "feedback", 60.0)
print("under way", flush=True)
call.result(60.0)
"""


def kill_amid_a_goal(site: Site, request: Plan.Request) -> None:
    """Let a process send a goal, and kill the process while the goal is planned."""
    fields = PlanContacts.Goal.get_fields_and_field_types()
    goal = PlanContacts.Goal(**{name: getattr(request, name) for name in fields})
    command = [sys.executable, "-c", SEND_A_GOAL, serialize_message(goal).hex()]
    environment = {**os.environ, "ROS_DOMAIN_ID": str(site.domain)}
    client = subprocess.Popen(command, env=environment, stdout=subprocess.PIPE)
    assert client.stdout is not None
    assert client.stdout.readline() == b"under way\n"
    client.kill()
    client.wait(60.0)


def client_of(executive: Executive) -> PlannerClient:
    """A client as executives use it, on the node of a test's client."""

    def spin_until(done: object, timeout: float) -> None:
        end = time.monotonic() + timeout
        while not done() and time.monotonic() < end:  # type: ignore[operator]
            executive.executor.spin_once(0.02)

    client = PlannerClient(executive.node, spin_until=spin_until)
    client.wait_for_planner(20.0)
    return client


def friction(executive: Executive) -> float:
    """Friction coefficient of the first surface that the planner knows, 0 without one."""
    answer = executive.ask(GetEnvironment, "get_environment", GetEnvironment.Request())
    return max((surface.friction for surface in answer.environment.surfaces[:1]), default=0.0)


@pytest.fixture
def walked(executive: Executive, ground: SurfaceArray, request_on_ground: Plan.Request) -> str:
    """The identifier of a sequence on flat ground that is published and valid."""
    executive.give(ground)
    answer = executive.call(request_on_ground)
    assert answer.result.code == PlanningResult.SUCCESS, answer.result.text
    executive.listen()
    identity = str(answer.sequence.sequence_id)
    told = executive.statuses
    executive.spin_until(lambda: told and told[-1].sequence_id == identity, "its status")
    return identity


def test_client_killed_amid_its_goal(
    shared: Site, executive: Executive, gap: SurfaceArray, request_over_gap: Plan.Request
) -> None:
    executive.give(gap)
    executive.listen()
    told = executive.statuses
    request_over_gap.time_limit = 1.5
    kill_amid_a_goal(shared, request_over_gap)
    # The goal without a client goes on, and ends by itself.
    executive.spin_until(lambda: told and told[-1].state == PlannerStatus.FAILED, "its end")
    assert told[-1].result.code == PlanningResult.TIME_LIMIT
    request_over_gap.time_limit = 30.0
    kill_amid_a_goal(shared, request_over_gap)
    # A goal that would take long is preempted by the next one.
    request_over_gap.goal.pose.position.x = 0.2
    started = time.monotonic()
    result = client_of(executive).plan(request_over_gap).result(20.0)
    assert result.result.code == PlanningResult.SUCCESS, result.result.text
    assert time.monotonic() - started < 20.0
    assert "Traceback" not in shared.processes[0].log.read_text()


def test_goals_of_two_executives(
    shared: Site, executive: Executive, gap: SurfaceArray, request_over_gap: Plan.Request
) -> None:
    executive.give(gap)
    other = shared.executive()
    here, there = client_of(executive), client_of(other)
    first = here.plan(request_over_gap)
    here.wait_until(lambda: first.feedback is not None, "feedback", 60.0)
    request_over_gap.goal.pose.position.x = 0.2
    result = there.plan(request_over_gap).result(20.0)
    assert result.result.code == PlanningResult.SUCCESS
    assert first.result(20.0).result.code == PlanningResult.PREEMPTED
    # Both receive the newest sequence.
    identity = result.sequence.sequence_id
    for client in (here, there):
        client.wait_until(
            lambda c=client: c.status.sequence_id == identity and c.sequence is not None,
            "its status",
            60.0,
        )
        assert client.sequence is not None
        assert client.sequence.sequence_id == identity


def test_status_is_of_the_newer_of_two_plans(
    executive: Executive, walked: str, request_on_ground: Plan.Request
) -> None:
    told = executive.statuses
    told.clear()
    calls = [executive.start_call(request_on_ground) for _ in range(2)]
    first, second = (executive.answer(call).sequence.sequence_id for call in calls)
    executive.spin_until(lambda: told[-1].sequence_id == second, "status of the second")
    assert told[-1].state == PlannerStatus.VALID
    states = [status.state for status in told if status.sequence_id == first]
    assert states[0] == PlannerStatus.PLANNING  # because of the second call


def test_status_after_a_replan_that_came_too_late(
    shared: Site, executive: Executive, walked: str
) -> None:
    told, planner = executive.statuses, shared.processes[0]
    execution = executive.node.create_publisher(ExecutionState, f"{NODE}/execution_state", CALLS)
    executive.spin_until(lambda: execution.get_subscription_count() > 0, "a subscriber")
    worker = planner.worker()
    os.kill(worker, signal.SIGSTOP)
    call = executive.start_asking(Replan, "replan", Replan.Request(from_state=1))
    executive.spin_until(lambda: told[-1].state == PlannerStatus.PLANNING, "replanning")
    execution.publish(ExecutionState(sequence_id=walked, state=2))
    executive.spin_until(lambda: told[-1].executed_state == 2, "notice of the robot's state")
    os.kill(worker, signal.SIGCONT)
    executive.spin_until(call.done, "an answer")
    assert call.result().result.code == PlanningResult.OUTDATED, call.result().result.text
    executive.spin_until(lambda: told[-1].state == PlannerStatus.VALID, "status VALID")
    assert (told[-1].sequence_id, told[-1].revision) == (walked, 0)


def test_watching_process_killed_amid_its_look(
    shared: Site, executive: Executive, walked: str, gap: SurfaceArray
) -> None:
    told, planner = executive.statuses, shared.processes[0]
    watcher = planner.worker("validating")
    os.kill(watcher, signal.SIGSTOP)
    executive.publish(gap)
    executive.spin_until(lambda: executive.known() == {"here", "there"}, "the surfaces")
    count = len(told)
    os.kill(watcher, signal.SIGKILL)
    # A new process repeats the validation; on the gap's surfaces the feet are on another polygon
    # than planned.
    executive.spin_until(
        lambda: any(s.state == PlannerStatus.INVALIDATED for s in told[count:]), "a look"
    )
    assert all(s.result.code != PlanningResult.WORKER_LOST for s in told[count:])
    assert planner.worker("validating") != watcher


def test_what_nobody_could_look_at_is_not_said_to_hold(
    shared: Site, executive: Executive, walked: str, ground: SurfaceArray, gap: SurfaceArray
) -> None:
    """Process after process dies in a validation; a plan that fails then changes nothing."""
    told, planner = executive.statuses, shared.processes[0]
    os.kill(planner.worker("validating"), signal.SIGSTOP)
    executive.publish(gap)
    executive.spin_until(lambda: executive.known() == {"here", "there"}, "the surfaces")

    def lost() -> bool:
        for process in planner.workers("validating"):
            os.kill(process, signal.SIGKILL)  # a new one takes a second to start
        return told[-1].result.code == PlanningResult.WORKER_LOST

    executive.spin_until(lost, "the loss of them")
    assert told[-1].state == PlannerStatus.FAILED
    far = Plan.Request(robustness_threshold=10.0)
    far.start.pose.position.z = far.goal.pose.position.z = 0.6
    far.goal.pose.position.x = 50.0
    count = len(told)
    assert executive.call(far).result.code == PlanningResult.GOAL_UNREACHABLE
    executive.spin_until(
        lambda: told[-1].result.code == PlanningResult.GOAL_UNREACHABLE, "the reason"
    )
    assert PlannerStatus.VALID not in {status.state for status in told[count:]}
    assert (told[-1].state, told[-1].sequence_id) == (PlannerStatus.FAILED, walked)
    executive.publish(ground)
    executive.spin_until(lambda: told[-1].state == PlannerStatus.VALID, "a look")


def test_surfaces_that_stop_while_it_plans(
    shared: Site, executive: Executive, ground: SurfaceArray, request_on_ground: Plan.Request
) -> None:
    perception = shared.executive()
    for seconds in range(1, 11):
        ground.header.stamp.sec = seconds
        ground.surfaces[0].friction = 0.5 + 0.01 * seconds
        perception.publish(ground)
    newest = ground.surfaces[0].friction
    executive.spin_until(lambda: friction(executive) == newest, "the surfaces")
    executive.listen()
    told = executive.statuses
    request_on_ground.start.pose.position.x = -4.0
    request_on_ground.goal.pose.position.x = 4.0
    call = executive.start_call(request_on_ground)
    executive.spin_until(lambda: told and told[-1].state == PlannerStatus.PLANNING, "planning")
    perception.close()
    assert not call.done()
    answer = executive.answer(call)
    assert answer.result.code == PlanningResult.SUCCESS, answer.result.text
    # The newest surfaces are still known, with their stamp.
    assert answer.sequence.surfaces_stamp.sec == 10
    assert executive.known() == {"ground"}
    found = executive.ask(Validate, "validate", Validate.Request())
    assert (found.valid, found.surfaces_stamp.sec) == (True, 10)
