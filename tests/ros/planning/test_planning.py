"""From surfaces on a topic to a checked contact sequence on a latched topic."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from rbprm_msgs.msg import SurfaceArray
from rbprm_msgs.srv import Plan

from rbprm_core.check import check_plan
from rbprm_core.plan_record import EnvironmentEntry
from rbprm_core.robot import Robot, load_description
from rbprm_core.scenario import load_scenario
from rbprm_ros.conversions import plan_of_messages, request_message
from rbprm_ros.rclpy_utils.qos import LATCHED, STREAM

if TYPE_CHECKING:
    from conftest import Executive, Site


@pytest.mark.parametrize("name", ["flat", "rubble"])
def test_scenario_is_planned_and_published_and_valid(name: str, site: Site) -> None:
    """The main use: perception, planner and executive are three processes."""
    planner = site.start("planner_node")
    executive = site.executive()
    surfaces = site.start("publish_surfaces", name)
    scenario = load_scenario(name)
    robot = Robot.load(load_description("hyq"))
    request = request_message(scenario.request_for(robot, seed=1), "hyq", 60.0)
    executive.listen()
    response = executive.call_on_surfaces(request)
    assert response.result.code == response.result.SUCCESS, response.result.text
    executive.spin_until(lambda: executive.sequences and executive.guides, "sequence on its topic")
    sequence, guide = executive.sequences[-1], executive.guides[-1]
    assert sequence == response.sequence
    assert guide == response.guide
    assert sequence.header.frame_id == "map"
    assert sequence.header.stamp.sec > 0
    assert sequence.surfaces_stamp.sec > 0
    assert (sequence.robot, sequence.revision, sequence.seed) == ("hyq", 0, 1)
    assert sequence.sequence_id
    statistics = response.statistics
    assert statistics.states == len(sequence.states) > 10
    assert statistics.min_robustness >= 10.0
    times = {time.stage: time.seconds for time in statistics.times}
    assert 0 < times["sequence"] <= statistics.time_total
    # In the mesh of the surfaces, not in the environment that the node received.
    plan = plan_of_messages(sequence, guide, scenario.environment_entry())
    report = check_plan(plan)
    assert report.valid, [str(violation) for violation in report.violations[:5]]
    assert surfaces.stop() == 0
    assert planner.stop() == 0


def test_late_subscriber_gets_the_latched_sequence(
    shared: Site, executive: Executive, ground: SurfaceArray, request_on_ground: Plan.Request
) -> None:
    executive.publish(ground)
    response = executive.call_on_surfaces(request_on_ground)
    assert response.result.code == 0, response.result.text
    late = shared.executive()
    late.listen()
    late.spin_until(lambda: late.sequences and late.guides, "latched sequence")
    assert late.sequences[0] == response.sequence
    assert late.guides[0] == response.guide


@pytest.mark.parametrize("qos", [LATCHED, STREAM], ids=["latched", "volatile"])
def test_node_hears_publishers_of_either_durability(
    qos: Any, site: Site, ground: SurfaceArray, request_on_ground: Plan.Request
) -> None:
    site.planner()
    executive = site.executive()
    executive.publish(ground, qos)
    assert executive.call_on_surfaces(request_on_ground).result.code == 0


def test_surfaces_latched_before_the_node_came_are_known(
    site: Site, request_on_ground: Plan.Request
) -> None:
    site.start("publish_surfaces", "flat").wait_for("surfaces on")
    site.start("planner_node")
    assert site.executive().call_on_surfaces(request_on_ground).result.code == 0


def test_the_same_request_twice_gives_the_same_states(
    executive: Executive, ground: SurfaceArray, request_on_ground: Plan.Request
) -> None:
    executive.publish(ground)
    first = executive.call_on_surfaces(request_on_ground)
    second = executive.call(request_on_ground)
    assert first.sequence.states == second.sequence.states
    assert first.sequence.sequence_id != second.sequence.sequence_id


def test_bounds_of_the_request_hold(
    executive: Executive, ground: SurfaceArray, request_on_ground: Plan.Request
) -> None:
    executive.publish(ground)
    bounds = request_on_ground.bounds
    bounds.low.x, bounds.high.x = -1.0, 0.5  # the goal is at 1
    bounds.low.y, bounds.high.y, bounds.high.z = -1.0, 1.0, 1.0
    result = executive.call_on_surfaces(request_on_ground).result
    assert (result.code, result.field) == (result.INVALID_INPUT, "goal")


def test_plan_file_of_what_came_over_the_topic(
    executive: Executive, ground: SurfaceArray, request_on_ground: Plan.Request, tmp_path: Path
) -> None:
    executive.publish(ground)
    response = executive.call_on_surfaces(request_on_ground)
    plan = plan_of_messages(
        response.sequence, response.guide, EnvironmentEntry(), response.statistics
    )
    plan.write(tmp_path / "plan.json")
    assert type(plan).read(tmp_path / "plan.json") == plan
