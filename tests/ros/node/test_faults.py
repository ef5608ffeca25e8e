"""The node under load and misuse: it answers every call once and ends cleanly."""

from __future__ import annotations

import os
import signal
import statistics
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from rbprm_msgs.action import PlanContacts
from rbprm_msgs.msg import PlanningResult, SurfaceArray
from rbprm_msgs.srv import Plan
from rcl_interfaces.msg import SetParametersResult
from rcl_interfaces.srv import GetParameters, SetParameters
from rclpy.action import ActionClient
from rclpy.parameter import Parameter

if TYPE_CHECKING:
    from conftest import Executive, Process, Site

NODE = "/rbprm_planner"
STOP_TIME = 15.0  # seconds for the end after a signal on a busy machine


def start_search(executive: Executive, planner: Process, gap: SurfaceArray, request: Plan.Request):  # type: ignore[no-untyped-def]
    """Let the planner search where there is no plan; returns the call's future."""
    executive.publish(gap)
    future = executive.start_call(request)
    executive.spin_until(lambda: "guide 0%" in planner.log.read_text(), "search")
    return future


def debugging(site: Site) -> Process:
    """A planner that logs the stages of planning."""
    return site.planner("--ros-args", "--log-level", "rbprm_planner:=debug")


def gone(pid: int) -> bool:
    """Whether no process has an id, not even a zombie."""
    return not Path(f"/proc/{pid}").exists()


def wait_for_library(process: Process, name: str) -> None:
    """Wait until a process has loaded a library."""
    maps = Path(f"/proc/{process.popen.pid}/maps")
    end = time.monotonic() + 20
    while name not in maps.read_text():
        assert time.monotonic() < end
        time.sleep(0.001)


def set_parameter(executive: Executive, name: str, value: Any) -> SetParametersResult:
    """Set a parameter of the planner."""
    client = executive.node.create_client(SetParameters, f"{NODE}/set_parameters")
    executive.reach(client, client.service_is_ready, "the parameter service")
    parameter = Parameter(name, value=value).to_parameter_msg()
    future = client.call_async(SetParameters.Request(parameters=[parameter]))
    executive.spin_until(future.done, "an answer")
    return future.result().results[0]


def test_other_callbacks_are_served_while_planning(
    site: Site, gap: SurfaceArray, request_over_gap: Plan.Request
) -> None:
    planner, executive = debugging(site), site.executive()
    running = start_search(executive, planner, gap, request_over_gap)
    client = executive.node.create_client(GetParameters, f"{NODE}/get_parameters")
    executive.reach(client, client.service_is_ready, "the parameter service")
    seconds = []
    for _ in range(30):
        started = time.monotonic()
        future = client.call_async(GetParameters.Request(names=["robot"]))
        executive.spin_until(future.done, "an answer")
        seconds.append(time.monotonic() - started)
        assert future.result().values[0].string_value == "hyq"
    assert statistics.median(seconds) < 0.05
    # Surfaces are accepted, and a call that needs no planning is answered at once.
    executive.publish(SurfaceArray())
    executive.spin_until(lambda: "surfaces 2: 0" in planner.log.read_text(), "surfaces taken in")
    assert executive.call(request_over_gap, timeout=2.0).result.field == "surfaces"
    assert not running.done()


def test_time_limit_holds(site: Site, gap: SurfaceArray, request_over_gap: Plan.Request) -> None:
    site.planner()
    executive = site.executive()
    executive.publish(gap)
    executive.call_on_surfaces(request_over_gap.__class__())  # the surfaces are known
    request_over_gap.time_limit = 1.0
    durations: list[float] = []
    while len(durations) < 8 and min(durations, default=2.0) >= 1.3:  # some may be delayed
        started = time.monotonic()
        result = executive.call(request_over_gap).result
        durations.append(time.monotonic() - started)
        assert result.code == PlanningResult.TIME_LIMIT, result.text
    assert 1.0 < min(durations) < 1.3


def test_worker_killed_while_planning(
    site: Site, gap: SurfaceArray, request_over_gap: Plan.Request
) -> None:
    planner, executive = debugging(site), site.executive()
    future = start_search(executive, planner, gap, request_over_gap)
    waiting = executive.start_call(request_over_gap)
    worker = planner.worker()
    os.kill(worker, signal.SIGKILL)
    result = executive.answer(future, 20.0).result
    assert result.code == PlanningResult.WORKER_LOST
    assert result.cause == PlanningResult.CAUSE_PROCESS_DIED
    assert "signal 9" in result.text
    # The waiting call is not lost: a new process serves it.
    executive.spin_until(lambda: planner.log.read_text().count("guide 0%") == 2, "second search")
    assert not waiting.done()
    assert gone(worker)
    request_over_gap.goal.pose.position.x = 0.2
    assert planner.worker() != worker
    os.kill(planner.worker(), signal.SIGKILL)
    assert executive.answer(waiting, 20.0).result.code == PlanningResult.WORKER_LOST
    assert executive.call(request_over_gap).result.code == PlanningResult.SUCCESS


def test_worker_killed_while_idle(
    site: Site, ground: SurfaceArray, request_on_ground: Plan.Request
) -> None:
    planner, executive = site.planner(), site.executive()
    executive.publish(ground)
    assert executive.call_on_surfaces(request_on_ground).result.code == PlanningResult.SUCCESS
    worker = planner.worker()
    os.kill(worker, signal.SIGKILL)
    executive.spin_until(lambda: gone(worker), "notice of its death")
    assert executive.call(request_on_ground).result.code == PlanningResult.SUCCESS


def test_worker_ends_with_a_node_that_is_killed(
    site: Site, gap: SurfaceArray, request_over_gap: Plan.Request
) -> None:
    planner, executive = debugging(site), site.executive()
    start_search(executive, planner, gap, request_over_gap)
    worker = planner.worker()
    planner.popen.kill()
    planner.popen.wait(STOP_TIME)
    executive.spin_until(lambda: gone(worker), "end of the worker")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["SIGINT", "SIGTERM"])
def test_clean_end_while_idle(site: Site, number: int) -> None:
    planners = [site.start("planner_node") for _ in range(2)]
    for planner in planners:
        planner.wait_for("process is ready")
        workers = planner.children()
        assert planner.stop(number, STOP_TIME) == 0, planner.log.read_text()
        assert all(gone(worker) for worker in workers)
        assert "Traceback" not in planner.log.read_text()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["SIGINT", "SIGTERM"])
@pytest.mark.parametrize("attempt", range(2))
def test_clean_end_while_planning(
    site: Site, number: int, attempt: int, gap: SurfaceArray, request_over_gap: Plan.Request
) -> None:
    planner, executive = debugging(site), site.executive()
    running = start_search(executive, planner, gap, request_over_gap)
    waiting = executive.start_call(request_over_gap)
    worker = planner.worker()
    planner.popen.send_signal(number)
    for future in (running, waiting):
        assert executive.answer(future, STOP_TIME).result.code == PlanningResult.CANCELLED
    assert planner.popen.wait(STOP_TIME) == 0, planner.log.read_text()
    assert gone(worker)
    assert "Traceback" not in planner.log.read_text()


def test_goal_is_answered_when_the_node_ends(
    site: Site, gap: SurfaceArray, request_over_gap: Plan.Request
) -> None:
    planner, executive = site.planner(), site.executive()
    client = ActionClient(executive.node, PlanContacts, "/rbprm_planner/plan_contacts")
    executive.publish(gap)
    executive.reach(client, client.server_is_ready, "the action")
    fields = PlanContacts.Goal.get_fields_and_field_types()
    goal = PlanContacts.Goal(**{name: getattr(request_over_gap, name) for name in fields})
    told: list[object] = []
    sent = client.send_goal_async(goal, told.append)
    executive.spin_until(sent.done, "an accepted goal")
    ended = sent.result().get_result_async()
    executive.spin_until(lambda: len(told) > 1, "feedback")
    planner.popen.send_signal(signal.SIGTERM)
    executive.spin_until(ended.done, "a result", STOP_TIME)
    assert ended.result().result.result.code == PlanningResult.CANCELLED
    assert planner.popen.wait(STOP_TIME) == 0, planner.log.read_text()


def test_signal_before_the_planning_process_is_ready(site: Site) -> None:
    planner = site.start("planner_node")
    planner.wait_for("up;")
    assert planner.stop(signal.SIGTERM, STOP_TIME) == 0, planner.log.read_text()


def test_signal_while_the_node_still_loads_its_libraries(site: Site) -> None:
    planner = site.start("planner_node")
    wait_for_library(planner, "rclpy")
    assert planner.stop(signal.SIGTERM) == 0, planner.log.read_text()


def test_two_clients_at_once_are_both_answered(
    site: Site, ground: SurfaceArray, request_on_ground: Plan.Request
) -> None:
    site.planner()
    first, second = site.executive(), site.executive()
    first.publish(ground)
    assert first.call_on_surfaces(request_on_ground).result.code == PlanningResult.SUCCESS
    second.wait_for_planner()
    calls = []
    for seed in range(8):
        request_on_ground.seed = seed
        calls += [(seed, client.client.call_async(request_on_ground)) for client in (first, second)]
    deadline = time.monotonic() + 60
    while not all(future.done() for _, future in calls) and time.monotonic() < deadline:
        first.executor.spin_once(0.01)
        second.executor.spin_once(0.01)
    answers = [(seed, future.result()) for seed, future in calls]
    assert all(a.result.code == PlanningResult.SUCCESS for _, a in answers)
    assert all(a.sequence.seed == seed for seed, a in answers)
    assert len({a.sequence.sequence_id for _, a in answers}) == len(answers)


def test_parameters_at_run_time(
    site: Site, gap: SurfaceArray, request_over_gap: Plan.Request
) -> None:
    site.planner()
    executive = site.executive()
    executive.publish(gap)
    executive.call_on_surfaces(Plan.Request())
    request_over_gap.time_limit = 0.0
    assert set_parameter(executive, "time_limit", 0.5).successful
    result = executive.call(request_over_gap).result
    assert result.code == PlanningResult.TIME_LIMIT
    assert "0.5 s" in result.text
    for name, value, reason in (
        ("time_limit", -1.0, "range"),
        ("time_limit", float("nan"), "time_limit"),
        ("sequence.step", 0.0, "range"),
        ("robot", "spot", "neither a known name"),
        ("guides", 2.5, "type"),
        ("planning_frame", "odom", "read-only"),
    ):
        refused = set_parameter(executive, name, value)
        assert not refused.successful, name
        assert reason in refused.reason, name
    assert set_parameter(executive, "guides", 3).successful
