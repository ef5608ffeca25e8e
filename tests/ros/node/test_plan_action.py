"""The action: feedback, a growing sequence, cancellation, preemption, partial results."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from typing import TYPE_CHECKING

import pytest
from action_msgs.msg import GoalStatus
from rbprm_msgs.action import PlanContacts
from rbprm_msgs.msg import ContactSequence, PlanningResult, SurfaceArray
from rbprm_msgs.srv import Plan
from rclpy.action import ActionClient
from tests.ros.conftest import ENDLESS

from rbprm_ros.rclpy_utils.qos import CALLS

if TYPE_CHECKING:
    from conftest import Executive, Site

NAME = "/rbprm_planner/plan_contacts"


def goal_of(request: Plan.Request) -> PlanContacts.Goal:
    """A request as a goal."""
    fields = PlanContacts.Goal.get_fields_and_field_types()
    return PlanContacts.Goal(**{name: getattr(request, name) for name in fields})


class Goal:
    """A goal sent to the planner, its feedback and its result."""

    def __init__(self, executive: Executive, client: ActionClient, request: Plan.Request) -> None:
        self._executive = executive
        self.feedback: list[PlanContacts.Feedback] = []
        sent = client.send_goal_async(
            goal_of(request), lambda message: self.feedback.append(message.feedback)
        )
        executive.spin_until(sent.done, "an accepted goal")
        self._handle = sent.result()
        assert self._handle.accepted
        self._result = self._handle.get_result_async()

    def cancel(self) -> None:
        """Cancel the goal."""
        self._handle.cancel_goal_async()

    def done(self) -> bool:
        """Whether the result has come."""
        return bool(self._result.done())

    def result(self, timeout: float = 20.0) -> tuple[int, PlanContacts.Result]:
        """Wait for status and result, and return them."""
        self._executive.spin_until(self.done, "a result", timeout)
        answer = self._result.result()
        return answer.status, answer.result

    def wait_for(self, told: Callable[[PlanContacts.Feedback], bool], what: str) -> None:
        """Wait for feedback that meets a condition."""
        self._executive.spin_until(lambda: any(map(told, self.feedback)), what)


@pytest.fixture
def send(executive: Executive) -> Callable[[Plan.Request], Goal]:
    """A function that sends a request as a goal."""
    client = ActionClient(executive.node, PlanContacts, NAME)
    executive.reach(client, client.server_is_ready, "the action")
    return lambda request: Goal(executive, client, request)


@pytest.fixture
def search(executive: Executive, gap: SurfaceArray, request_over_gap: Plan.Request) -> Plan.Request:
    """A request that is searched until its time limit; its surfaces are known."""
    executive.publish(gap)
    executive.spin_until(lambda: len(executive.known()) == 2, "surfaces")
    return request_over_gap


@pytest.fixture
def long_walk(
    executive: Executive, ground: SurfaceArray, request_on_ground: Plan.Request
) -> Plan.Request:
    """A request with many states, which takes a while; its surfaces are known."""
    executive.publish(ground)
    executive.spin_until(lambda: len(executive.known()) == 1, "surfaces")
    request_on_ground.start.pose.position.x = -4.0
    request_on_ground.goal.pose.position.x = 4.0
    return request_on_ground


def test_goal_is_planned_with_feedback_and_published(
    executive: Executive, send: Callable[[Plan.Request], Goal], long_walk: Plan.Request
) -> None:
    parts: list[ContactSequence] = []
    executive.node.create_subscription(
        ContactSequence, "/rbprm_planner/partial_sequence", parts.append, CALLS
    )
    executive.listen()
    goal = send(long_walk)
    status, result = goal.result()
    assert (status, result.result.code) == (GoalStatus.STATUS_SUCCEEDED, PlanningResult.SUCCESS)
    stages = [told.stage for told in goal.feedback]
    assert "sequence" in stages
    assert set(stages) <= {"robot data", "start", "guide", "shortcut", "sequence"}
    assert all(0 <= told.fraction <= 1 for told in goal.feedback)
    times = [told.time for told in goal.feedback]
    assert times == sorted(times)
    assert times[-1] <= result.statistics.time_total
    states = [told.states for told in goal.feedback]
    assert 0 < max(states) <= len(result.sequence.states)
    sequence = result.sequence
    assert sequence.complete
    executive.spin_until(
        lambda: any(s == sequence for s in executive.sequences), "the published sequence"
    )
    assert parts
    assert all(not part.complete for part in parts)
    assert {part.sequence_id for part in parts} == {sequence.sequence_id}
    # Each partial sequence has the first states of the plan.
    assert any(part.states == sequence.states[: len(part.states)] for part in parts)


def test_cancel_stops_the_work_within_100_ms(
    send: Callable[[Plan.Request], Goal], search: Plan.Request
) -> None:
    seconds = []
    for _ in range(5):
        goal = send(search)
        goal.wait_for(lambda told: told.stage == "guide", "search")
        started = time.monotonic()
        goal.cancel()
        status, result = goal.result(2.0)
        seconds.append(time.monotonic() - started)
        assert (status, result.result.code) == (
            GoalStatus.STATUS_CANCELED,
            PlanningResult.CANCELLED,
        )
        assert not result.sequence.states
    print(f"\ncancel to result, while searching a guide: {[f'{1e3 * s:.0f} ms' for s in seconds]}")
    assert statistics.median(seconds) < 0.1


def test_cancelled_goal_has_the_states_found_so_far(
    send: Callable[[Plan.Request], Goal], long_walk: Plan.Request
) -> None:
    goal = send(long_walk)
    goal.wait_for(lambda told: told.states >= 5, "some states")
    started = time.monotonic()
    goal.cancel()
    status, result = goal.result(2.0)
    print(f"\ncancel to partial result: {1e3 * (time.monotonic() - started):.0f} ms")
    assert (status, result.result.code) == (GoalStatus.STATUS_CANCELED, PlanningResult.CANCELLED)
    assert len(result.sequence.states) >= 5
    assert not result.sequence.complete
    assert result.sequence.states[0].contacts
    assert result.statistics.states == len(result.sequence.states)


def test_newer_goal_takes_the_place_of_the_one_under_way(
    send: Callable[[Plan.Request], Goal], search: Plan.Request
) -> None:
    first = send(search)
    first.wait_for(lambda told: told.stage == "guide", "search")
    search.goal.pose.position.x = 0.2
    second = send(search)
    status, result = first.result(2.0)
    assert (status, result.result.code) == (GoalStatus.STATUS_ABORTED, PlanningResult.PREEMPTED)
    status, result = second.result()
    assert (status, result.result.code) == (GoalStatus.STATUS_SUCCEEDED, PlanningResult.SUCCESS)


def test_of_many_goals_at_once_the_last_is_planned(
    executive: Executive, search: Plan.Request
) -> None:
    client = ActionClient(executive.node, PlanContacts, NAME)
    executive.reach(client, client.server_is_ready, "the action")
    sent = []
    for i in range(10):
        search.goal.pose.position.x = 0.2 if i == 9 else 5.0
        sent.append(client.send_goal_async(goal_of(search)))
    executive.spin_until(lambda: all(future.done() for future in sent), "ten accepted goals")
    results = [future.result().get_result_async() for future in sent]
    executive.spin_until(lambda: all(future.done() for future in results), "ten results")
    codes = [future.result().result.result.code for future in results]
    assert sorted(codes) == [PlanningResult.SUCCESS] + 9 * [PlanningResult.PREEMPTED]


def test_time_limit_holds(send: Callable[[Plan.Request], Goal], search: Plan.Request) -> None:
    search.time_limit = 1.0
    started = time.monotonic()
    status, result = send(search).result()
    seconds = time.monotonic() - started
    print(f"\ntime limit of 1 s: goal to result in {seconds:.3f} s")
    assert (status, result.result.code) == (GoalStatus.STATUS_ABORTED, PlanningResult.TIME_LIMIT)
    assert 1.0 < seconds < 1.3  # the planner needs 100 ms; the rest is for a busy machine


def test_invalid_goal_is_aborted_and_names_its_field(
    send: Callable[[Plan.Request], Goal], search: Plan.Request
) -> None:
    search.start.pose.orientation.w = 0.0
    status, result = send(search).result()
    assert (status, result.result.code) == (GoalStatus.STATUS_ABORTED, PlanningResult.INVALID_INPUT)
    assert result.result.field == "start.pose.orientation"


def test_goals_do_not_stop_calls(
    executive: Executive, send: Callable[[Plan.Request], Goal], search: Plan.Request
) -> None:
    """A goal preempts goals only; a call waits for its turn."""
    goal = send(search)
    goal.wait_for(lambda told: told.stage == "guide", "search")
    near = Plan.Request(start=search.start, robustness_threshold=10.0)
    near.goal.pose.position.z, near.goal.pose.position.x = 0.6, 0.2
    call = executive.start_call(near)
    goal.cancel()
    assert goal.result(2.0)[1].result.code == PlanningResult.CANCELLED
    assert executive.answer(call).result.code == PlanningResult.SUCCESS


def test_goals_beyond_those_that_may_wait_are_busy_and_take_nobodys_place(
    site: Site, gap: SurfaceArray, request_over_gap: Plan.Request
) -> None:
    site.planner(*ENDLESS, "-p", "max_calls:=2")
    executive = site.executive()
    executive.give(gap)
    client = ActionClient(executive.node, PlanContacts, NAME)
    executive.reach(client, client.server_is_ready, "the action")
    request_over_gap.time_limit = 1.0
    goal = goal_of(request_over_gap)
    sent = [client.send_goal_async(goal) for _ in range(10)]
    executive.spin_until(lambda: all(future.done() for future in sent), "ten accepted goals")
    results = [future.result().get_result_async() for future in sent]
    executive.spin_until(lambda: all(future.done() for future in results), "ten results")
    codes = [future.result().result.result.code for future in results]
    assert codes.count(PlanningResult.TIME_LIMIT) == 1
    assert PlanningResult.BUSY in codes
    others = {PlanningResult.BUSY, PlanningResult.PREEMPTED, PlanningResult.TIME_LIMIT}
    assert set(codes) <= others
