"""Conditions of a request through the node: gravity, grip, torso, limbs at the goal, threshold."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from ament_index_python import get_package_share_directory
from geometry_msgs.msg import Point
from rbprm_msgs.msg import ContactSequence, PlanningResult, Surface, SurfaceArray
from rbprm_msgs.srv import Plan, Replan, Validate
from std_msgs.msg import Header
from tests.ros.conftest import square, stamped

from rbprm_core.check import check_plan
from rbprm_core.plan_record import ContactPlan, EnvironmentEntry, SurfaceEntry
from rbprm_core.scenario import Scenario, load_scenario
from rbprm_ros.client.mission import parts_without_message
from rbprm_ros.conversions import plan_of_messages, request_message, surfaces_message

if TYPE_CHECKING:
    from conftest import Executive, Site

CONFIG = Path(get_package_share_directory("rbprm_ros")) / "config"
TORSO = ["torso_1_joint", "torso_2_joint"]
TALOS_LIMBS = ["left_leg", "right_leg", "right_arm"]
EDGES = ((-0.6, 0.0), (0.6, 0.0), (0.6, 2.0), (-0.6, 2.0))  # y and z
WALL = Surface(
    id="wall",
    vertices=[Point(x=0.7, y=y, z=z) for y, z in EDGES],
    friction=0.5,
)
ROUND_WALL = tuple(
    SurfaceEntry(id=s.id, vertices=tuple((p.x, p.y, p.z) for p in s.vertices), friction=0.5)
    for s in (square("ground", 5.0), WALL)
)


def surfaces_of(scenario: Scenario) -> SurfaceArray:
    """A scenario's surfaces."""
    return surfaces_message(scenario.scene().surfaces, Header(frame_id="map"))


def request_of(scenario: Scenario) -> Plan.Request:
    """A scenario's request, for its own robot."""
    request = scenario.request_for(scenario.load_robot())
    return request_message(request, scenario.robot, 60.0)


def require_valid(scenario: Scenario, answer: Any) -> ContactPlan:
    """The plan of an answer; fails where the check finds violations."""
    assert answer.result.code == PlanningResult.SUCCESS, answer.result.text
    environment = scenario.environment_entry()
    plan = plan_of_messages(answer.sequence, answer.guide, environment, answer.statistics)
    report = check_plan(plan)
    assert report.valid, [str(violation) for violation in report.violations[:5]]
    return plan


def test_hand_regrasps_a_pen_without_gravity(site: Site) -> None:
    """Plan, replan and validation all use gravity and grip force of the request."""
    scenario, executive = load_scenario("pen"), site.executive()
    site.planner("--ros-args", "--params-file", str(CONFIG / "allegro.yaml"))
    executive.give(surfaces_of(scenario))
    request = request_of(scenario)
    request.grip_force = 20.0
    answer = executive.call(request)
    plan = require_valid(scenario, answer)
    assert (plan.request.gravity, plan.request.grip_force) == ((0.0, 0.0, 0.0), 20.0)
    assert min(state.robustness for state in plan.states) > 0
    assert executive.ask(Validate, "validate", Validate.Request()).valid
    # The same for a sequence in a call: its own threshold and grip force are used.
    answer.sequence.robustness_threshold = 0.999 * answer.statistics.min_robustness
    sent = Validate.Request(sequence=answer.sequence)
    assert executive.ask(Validate, "validate", sent).valid
    sent.sequence.grip_force = 10.0
    assert not executive.ask(Validate, "validate", sent).valid
    replanned = executive.ask(Replan, "replan", Replan.Request(from_state=2))
    again = require_valid(scenario, replanned)
    assert again.request.grip_force == 20.0


def test_torso_is_planned_with_the_root_and_goal_limbs_are_told(site: Site) -> None:
    """Talos round a wall: the guide path is searched with joints of the torso."""
    site.start("planner_node", "--ros-args", "-p", "robot:=talos")
    executive = site.executive()
    executive.give(SurfaceArray(surfaces=[square("ground", 5.0), WALL]))
    request = Plan.Request(limbs=TALOS_LIMBS, root_joints=TORSO, start=stamped(-0.5))
    request.goal = stamped(2.0)
    request.start.pose.position.z = request.goal.pose.position.z = 1.0
    request.required_limbs = request.start_limbs = ["left_leg", "right_leg"]
    request.goal_limbs = ["left_leg", "right_arm"]  # and no surface for a hand
    answer = executive.call(request, timeout=120.0)
    assert answer.result.code == PlanningResult.SUCCESS, answer.result.text
    assert torso_turns(answer.sequence)
    assert answer.sequence.goal_limbs == ["left_leg", "right_arm"]
    assert answer.sequence.missing_goal_limbs == ["right_arm"]
    assert answer.result.text == "limbs of goal_limbs without contact in the last state: right_arm"
    plan = plan_of_messages(answer.sequence, answer.guide, EnvironmentEntry(surfaces=ROUND_WALL))
    report = check_plan(plan)
    assert report.valid, [str(violation) for violation in report.violations[:5]]
    assert report.goal_missing == ("right_arm",)
    # Validation and replans include the torso too; other limbs may be requested.
    assert executive.ask(Validate, "validate", Validate.Request()).valid
    replan = Replan.Request(from_state=2, goal_limbs=["left_leg", "right_leg"])
    answer = executive.ask(Replan, "replan", replan)
    assert (answer.result.code, answer.result.text) == (PlanningResult.SUCCESS, "")
    assert answer.sequence.goal_limbs == ["left_leg", "right_leg"]
    assert answer.sequence.missing_goal_limbs == []
    assert torso_turns(answer.sequence)


def torso_turns(sequence: ContactSequence) -> bool:
    """Whether the joints of the torso move."""
    joints = [sequence.joint_names.index(name) for name in TORSO]
    return len({tuple(s.joint_positions[i] for i in joints) for s in sequence.states}) > 1


def test_states_under_the_threshold_are_told(
    site: Site, ground: SurfaceArray, request_on_ground: Plan.Request
) -> None:
    site.planner("--ros-args", "-p", "generator.accept_below_threshold:=true")
    executive = site.executive()
    executive.give(ground)
    request_on_ground.robustness_threshold = 10.0
    answer = executive.call(request_on_ground)
    assert (answer.result.code, answer.result.text) == (PlanningResult.SUCCESS, "")
    request_on_ground.robustness_threshold = 500.0
    answer = executive.call(request_on_ground)
    assert answer.result.code == PlanningResult.SUCCESS, answer.result.text
    minimum = answer.statistics.min_robustness
    assert minimum < 500.0
    text = f"the minimum robustness is {minimum:.3g} N, below the requested 500 N"
    assert answer.result.text.startswith(text)


def test_phases_add_up(
    executive: Executive, ground: SurfaceArray, request_on_ground: Plan.Request
) -> None:
    executive.give(ground)
    told = executive.call(request_on_ground).statistics
    phases = [time.seconds for time in told.times]
    assert min(phases) > 0
    assert sum(phases) == pytest.approx(told.time_total)
    assert told.guides >= 1


def test_executive_walks_a_hand_and_warns_of_what_it_cannot_ask_for(site: Site) -> None:
    site.planner("--ros-args", "--params-file", str(CONFIG / "allegro.yaml"))
    executive = site.start("executive", "--ros-args", "-p", "scenario:=pen", "-p", "rate:=50.0")
    assert executive.popen.wait(180.0) == 0, executive.log.read_text()
    log = executive.log.read_text()
    assert log.count("WARN") == 1, log
    assert "the scenario's [options], [environment.classification] cannot be requested" in log


@pytest.mark.parametrize(
    ("name", "parts"),
    [
        ("stairs", []),
        ("car", ["[trunk]"]),
        ("crawl", ["[heuristics]", "[options]"]),
        ("pen", ["[options]", "[environment.classification]"]),
    ],
)
def test_what_the_executive_cannot_ask_for(name: str, parts: list[str]) -> None:
    assert parts_without_message(load_scenario(name)) == parts
