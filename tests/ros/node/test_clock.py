"""Time limits and periods use the monotonic clock; the ROS clock gives stamps only."""

from __future__ import annotations

import itertools
import time
from typing import TYPE_CHECKING

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from rbprm_msgs.action import PlanContacts
from rbprm_msgs.msg import InvalidState, PlannerStatus, PlanningResult, SurfaceArray
from rbprm_msgs.srv import Plan
from rclpy.action import ActionClient
from rosgraph_msgs.msg import Clock

from rbprm_ros.rclpy_utils.qos import CALLS

if TYPE_CHECKING:
    from conftest import Executive, Site

JUMPS = (1000, 0, 2_000_000_000, 5, 1_000_000, 3)  # seconds of the clock, repeated
TICK = 0.01  # seconds between two of them
STOP_TIME = 15.0  # seconds for the end after a signal on a busy machine


@pytest.fixture
def simulated(site: Site) -> Executive:
    """A client of a planner with simulated time that is not published yet."""
    site.planner("--ros-args", "-p", "use_sim_time:=true")
    executive = site.executive()
    executive.listen()
    return executive


@pytest.fixture
def jumping(simulated: Executive) -> Executive:
    """A client of a planner whose clock jumps back and forth."""
    times = itertools.cycle(JUMPS)
    clock = simulated.node.create_publisher(Clock, "/clock", CALLS)

    def tick() -> None:
        message = Clock()
        message.clock.sec = next(times)
        clock.publish(message)

    simulated.spin_until(lambda: clock.get_subscription_count() > 0, "a subscriber")
    simulated.node.create_timer(TICK, tick)
    return simulated


def show(executive: Executive, surfaces: SurfaceArray) -> None:
    """Publish surfaces, and wait until the planner knows them."""
    wanted = {surface.id for surface in surfaces.surfaces}
    executive.publish(surfaces)
    executive.spin_until(lambda: executive.known() == wanted, "the surfaces")


def goal_until_its_limit(executive: Executive, request: Plan.Request) -> list[float]:
    """Let the planner search for a second; returns the times in its feedback."""
    client = ActionClient(executive.node, PlanContacts, "/rbprm_planner/plan_contacts")
    executive.reach(client, client.server_is_ready, "the action")
    request.time_limit = 1.0
    fields = PlanContacts.Goal.get_fields_and_field_types()
    goal = PlanContacts.Goal(**{name: getattr(request, name) for name in fields})
    times: list[float] = []
    started = time.monotonic()
    sent = client.send_goal_async(goal, lambda message: times.append(message.feedback.time))
    executive.spin_until(sent.done, "an accepted goal")
    ended = sent.result().get_result_async()
    executive.spin_until(ended.done, "a result")
    seconds = time.monotonic() - started
    assert ended.result().result.result.code == PlanningResult.TIME_LIMIT
    assert 1.0 < seconds < 10.0
    return times


def wait_for_state(executive: Executive, state: int) -> PlannerStatus:
    """Wait for a status; returns it."""
    told = executive.statuses
    executive.spin_until(lambda: told and told[-1].state == state, f"status {state}")
    return told[-1]


def plan_and_replan(executive: Executive, request: Plan.Request, ground: SurfaceArray) -> None:
    """Let the planner plan, and replan when a surface changes."""
    request.time_limit, request.goal.pose.position.x = 0.0, 1.0
    show(executive, ground)
    answer = executive.call(request)
    assert answer.result.code == PlanningResult.SUCCESS, answer.result.text
    wait_for_state(executive, PlannerStatus.VALID)
    count = len(executive.statuses)
    show(executive, SurfaceArray())
    invalidated = wait_for_state(executive, PlannerStatus.FAILED)
    assert {s.reason for s in executive.statuses[count].invalid_states} == {
        InvalidState.SURFACE_LOST
    }
    assert invalidated.sequence_id == answer.sequence.sequence_id
    show(executive, ground)
    wait_for_state(executive, PlannerStatus.VALID)


def test_clock_that_nobody_publishes(
    site: Site,
    simulated: Executive,
    gap: SurfaceArray,
    ground: SurfaceArray,
    request_over_gap: Plan.Request,
) -> None:
    healths: list[DiagnosticArray] = []
    simulated.node.create_subscription(DiagnosticArray, "/diagnostics", healths.append, CALLS)
    show(simulated, gap)
    times = goal_until_its_limit(simulated, request_over_gap)
    assert times == sorted(times)
    assert times[-1] > 0.5
    plan_and_replan(simulated, request_over_gap, ground)
    assert {status.header.stamp.sec for status in simulated.statuses} == {0}
    simulated.spin_until(lambda: len(healths) >= 2, "diagnostics")
    assert site.processes[0].stop(timeout=STOP_TIME) == 0


def test_clock_that_jumps(
    site: Site,
    jumping: Executive,
    gap: SurfaceArray,
    ground: SurfaceArray,
    request_over_gap: Plan.Request,
) -> None:
    show(jumping, gap)
    times = goal_until_its_limit(jumping, request_over_gap)
    assert times == sorted(times)
    assert 0.5 < times[-1] < 1.5
    # Later messages are newer, whatever their stamps.
    gap.header.stamp.sec, ground.header.stamp.sec = 2_000_000_000, 1
    show(jumping, gap)
    plan_and_replan(jumping, request_over_gap, ground)
    stamps = {status.header.stamp.sec for status in jumping.statuses}
    assert stamps <= {0, *JUMPS}
    assert len(stamps) > 1
    assert site.processes[0].stop(timeout=STOP_TIME) == 0
