"""Planner and executive are stopped, started again, or replaced."""

from __future__ import annotations

import signal
from typing import TYPE_CHECKING

from rbprm_msgs.msg import PlannerStatus, PlanningResult, SurfaceArray
from rbprm_msgs.srv import Plan, Replan, Validate

if TYPE_CHECKING:
    from conftest import Process, Site


def walker(site: Site, rate: float) -> Process:
    """An executive that moves HyQ over flat ground at a number of states a second."""
    mission = ("-p", "scenario:=flat", "-p", "edits:=false", "-p", f"rate:={rate}")
    process = site.start("executive", "--ros-args", *mission)
    process.wait_for("plan of")
    return process


def test_executive_whose_plan_is_replaced_and_whose_planner_stops(site: Site) -> None:
    planner = site.start("planner_node")
    first = walker(site, 1.0)
    second = walker(site, 1.0)
    assert first.popen.wait(60.0) == 1
    assert "has another sequence" in first.log.read_text()
    assert second.popen.poll() is None
    assert planner.stop(signal.SIGTERM) == 0
    assert second.popen.wait(60.0) == 1
    assert "was stopped or started again" in second.log.read_text()


def test_planner_started_again(
    site: Site, ground: SurfaceArray, request_on_ground: Plan.Request
) -> None:
    planner, before = site.start("planner_node"), site.executive()
    walking = walker(site, 1.0)
    before.listen()
    told, sequences = before.statuses, before.sequences
    before.spin_until(lambda: told and told[-1].state == PlannerStatus.VALID, "its status")
    before.spin_until(lambda: bool(sequences), "the sequence")
    planner.popen.kill()
    planner.popen.wait(60.0)
    site.start("planner_node")
    # Earlier clients receive an empty sequence; later ones receive none.
    before.spin_until(lambda: told[-1].state == PlannerStatus.IDLE, "status IDLE")
    assert (told[-1].sequence_id, told[-1].environment_version) == ("", 0)
    assert walking.popen.wait(60.0) == 1
    # The executive notices either the missing planner or the new planner's status first.
    ends = ("the planner is gone", "was stopped or started again")
    assert any(end in walking.log.read_text() for end in ends)
    after = site.executive()
    after.listen()
    assert after.known() == set()
    after.spin_until(lambda: bool(after.statuses), "a status")
    assert (after.statuses[-1].state, after.statuses[-1].sequence_id) == (PlannerStatus.IDLE, "")
    assert after.sequences == []
    assert after.call(request_on_ground).result.field == "surfaces"
    gone = Replan.Request(sequence_id=sequences[-1].sequence_id)
    assert after.ask(Replan, "replan", gone).result.code == PlanningResult.UNKNOWN_SEQUENCE
    # The environment is sent again; the sequence that was kept can be validated against it.
    floor = ground.surfaces[0]
    floor.id = sequences[-1].states[0].contacts[0].surface_id
    after.give(ground)
    kept = Validate.Request(sequence=sequences[-1])
    found = after.ask(Validate, "validate", kept)
    assert found.result.code == PlanningResult.SUCCESS, found.result.text
    assert after.call(request_on_ground).result.code == PlanningResult.SUCCESS
