"""Calls that plan nothing: validation, environment, and list of robots."""

from __future__ import annotations

import statistics
import time
from copy import deepcopy
from typing import TYPE_CHECKING

import pytest
from geometry_msgs.msg import Point
from rbprm_msgs.msg import (
    ContactSequence,
    InvalidState,
    Obstacle,
    PlanningResult,
    Surface,
    SurfaceArray,
)
from rbprm_msgs.srv import GetEnvironment, ListRobots, Plan, SetEnvironment, Validate
from shape_msgs.msg import Mesh, MeshTriangle

from rbprm_core.check import CheckReport, check_plan
from rbprm_core.robot import known_robots
from rbprm_ros.conversions import environment_entry, plan_of_messages

if TYPE_CHECKING:
    from conftest import Executive

MESH = "hpp_environments/meshes/multicontact/darpareduced.stl"  # rubble


def environment(executive: Executive) -> GetEnvironment.Response:
    """The environment that the planner knows."""
    return executive.ask(GetEnvironment, "get_environment", GetEnvironment.Request())


def set_surfaces(executive: Executive, message: SurfaceArray) -> SetEnvironment.Response:
    """Let the planner know exactly the given surfaces."""
    return executive.ask(
        SetEnvironment, "set_environment", SetEnvironment.Request(environment=message)
    )


def validate(
    executive: Executive, sequence: ContactSequence | None = None, first: int = 0
) -> Validate.Response:
    """Validate a sequence, by default the published one."""
    request = Validate.Request(sequence=sequence or ContactSequence(), from_state=first)
    return executive.ask(Validate, "validate", request)


@pytest.fixture
def sequence(
    executive: Executive, ground: SurfaceArray, request_on_ground: Plan.Request
) -> ContactSequence:
    """The published sequence, on flat ground."""
    assert set_surfaces(executive, ground).result.code == PlanningResult.SUCCESS
    answer = executive.call(request_on_ground)
    assert answer.result.code == PlanningResult.SUCCESS, answer.result.text
    return answer.sequence


def far_away(surface: Surface) -> SurfaceArray:
    """A surface beside the way."""
    for point in surface.vertices:
        point.x += 50.0
    return SurfaceArray(surfaces=[surface])


def test_published_sequence_holds_until_its_surface_goes(
    executive: Executive, sequence: ContactSequence, ground: SurfaceArray
) -> None:
    answer = validate(executive)
    assert (answer.result.code, answer.valid) == (PlanningResult.SUCCESS, True)
    assert answer.environment_version == environment(executive).environment_version
    by_id = validate(executive, ContactSequence(sequence_id=sequence.sequence_id))
    assert by_id.valid
    set_surfaces(executive, far_away(ground.surfaces[0]))
    answer = validate(executive)
    assert not answer.valid
    count = len(sequence.states)
    assert [state.index for state in answer.invalid_states] == list(range(count))
    assert {state.reason for state in answer.invalid_states} == {InvalidState.SURFACE_LOST}
    assert {state.surface_id for state in answer.invalid_states} == {"ground"}
    later = validate(executive, first=count - 2)
    assert [state.index for state in later.invalid_states] == [count - 2, count - 1]


def test_foreign_sequences_each_get_their_own_answer(
    executive: Executive, sequence: ContactSequence
) -> None:
    """Valid and invalid sequences in turn: none is confused with another."""
    own, lifted = deepcopy(sequence), deepcopy(sequence)
    own.sequence_id, lifted.sequence_id = "somebody's", "somebody else's"
    for state in lifted.states[2:]:
        state.root.position.z += 1.0
        for contact in state.contacts:
            contact.pose.position.z += 1.0
    for _ in range(3):
        assert validate(executive, own).valid
        answer = validate(executive, lifted)
        wanted = list(range(2, len(lifted.states)))
        assert [state.index for state in answer.invalid_states] == wanted
        assert validate(executive).valid


def test_threshold_of_the_sequence_counts(executive: Executive, sequence: ContactSequence) -> None:
    least = min(state.robustness for state in sequence.states)
    sequence.sequence_id, sequence.robustness_threshold = "other", 1.5 * least
    answer = validate(executive, sequence)
    assert answer.result.code == PlanningResult.SUCCESS
    weak = [s.index for s in sequence.states if s.robustness < 1.5 * least]
    assert weak
    assert set(weak) <= {state.index for state in answer.invalid_states}
    assert {s.reason for s in answer.invalid_states} == {InvalidState.NOT_IN_EQUILIBRIUM}


def test_sequence_that_cannot_be_read_names_its_field(
    executive: Executive, sequence: ContactSequence
) -> None:
    def field_of(spoilt: ContactSequence) -> str:
        result = validate(executive, spoilt).result
        assert result.code == PlanningResult.INVALID_INPUT, result.text
        return str(result.field)

    sequence.sequence_id = "other"
    spoilt = deepcopy(sequence)
    spoilt.robot = "/etc/passwd"
    assert field_of(spoilt) == "sequence.robot"
    spoilt = deepcopy(sequence)
    spoilt.states[1].joint_positions = []
    assert field_of(spoilt) == "sequence.states.1.joint_positions"
    spoilt = deepcopy(sequence)
    spoilt.states[2].contacts[0].limb = "tail"
    assert field_of(spoilt) == "sequence.states.2.contacts.0.limb"
    spoilt = deepcopy(sequence)
    spoilt.states[0].contacts[1].pose.position.x = 1e9
    assert field_of(spoilt) == "sequence.states.0.contacts.1.pose.position"
    spoilt = deepcopy(sequence)
    spoilt.states = spoilt.states[:1] * 1001
    result = validate(executive, spoilt).result
    assert (result.field, result.value) == ("sequence.states", "1001 states")
    assert "max_states is 1000" in result.text
    assert validate(executive).valid  # the published one, after all others


def test_unknown_sequence_without_states(executive: Executive, sequence: ContactSequence) -> None:
    result = validate(executive, ContactSequence(sequence_id="never seen")).result
    assert (result.code, result.field) == (PlanningResult.UNKNOWN_SEQUENCE, "sequence_id")


def test_validation_is_quick_while_planning(
    executive: Executive,
    sequence: ContactSequence,
    gap: SurfaceArray,
    request_over_gap: Plan.Request,
) -> None:
    """One process plans at full load; another one answers."""
    set_surfaces(executive, gap)
    request_over_gap.time_limit = 4.0
    running = executive.start_call(request_over_gap)
    end = time.monotonic() + 0.5
    executive.spin_until(lambda: time.monotonic() > end, "the search under way")
    seconds = []
    for _ in range(40):
        started = time.monotonic()
        answer = validate(executive)
        seconds.append(time.monotonic() - started)
        assert answer.result.code == PlanningResult.SUCCESS
    assert not running.done()
    print(
        f"\nvalidate, {len(sequence.states)} states, while planning: median "
        f"{1e3 * statistics.median(seconds):.1f} ms, most {1e3 * max(seconds):.1f} ms"
    )
    assert statistics.median(seconds) < 0.05


def test_environment_is_what_was_set(executive: Executive, ground: SurfaceArray) -> None:
    answer = set_surfaces(executive, ground)
    assert (answer.result.code, answer.surfaces, answer.obstacles) == (0, 1, 0)
    known = environment(executive)
    assert known.environment.surfaces == ground.surfaces
    assert known.environment_version == answer.environment_version
    again = set_surfaces(executive, known.environment)
    assert again.environment_version == answer.environment_version  # recognised as unchanged


def test_environment_of_a_mesh(executive: Executive, request_on_ground: Plan.Request) -> None:
    request = SetEnvironment.Request(mesh=MESH, friction=0.6)
    answer = executive.ask(SetEnvironment, "set_environment", request)
    assert answer.result.code == PlanningResult.SUCCESS, answer.result.text
    assert answer.surfaces > 1
    known = environment(executive).environment
    assert len(known.surfaces) == answer.surfaces
    assert {surface.friction for surface in known.surfaces} == {0.6}
    assert executive.call(request_on_ground).result.field != "surfaces"


def test_wrong_environment_changes_nothing(executive: Executive, ground: SurfaceArray) -> None:
    set_surfaces(executive, ground)
    version = environment(executive).environment_version
    for spoil, field in (
        (lambda s: s.vertices.clear(), "environment.surfaces.0.vertices"),
        (lambda s: setattr(s, "friction", -1.0), "environment.surfaces.0.friction"),
        (lambda s: setattr(s, "id", ""), "environment.surfaces.0.id"),
    ):
        wrong = deepcopy(ground)
        spoil(wrong.surfaces[0])
        result = set_surfaces(executive, wrong).result
        assert (result.code, result.field) == (PlanningResult.INVALID_INPUT, field), result.text
        assert field in result.text
    for mesh in ("/etc/passwd", "package://nothing/here.obj", ""):
        request = SetEnvironment.Request(mesh=mesh)
        result = executive.ask(SetEnvironment, "set_environment", request).result
        assert (result.code, result.field) == (PlanningResult.INVALID_INPUT, "mesh")
    known = environment(executive)
    assert known.environment_version == version
    assert known.environment.surfaces == ground.surfaces


def test_robots(executive: Executive) -> None:
    answer = executive.ask(ListRobots, "list_robots", ListRobots.Request())
    assert answer.default_robot == "hyq"
    robots = {robot.name: robot for robot in answer.robots}
    assert set(robots) == set(known_robots())
    assert list(robots["hyq"].limbs) == ["lf_leg", "rf_leg", "lh_leg", "rh_leg"]
    assert 0.4 < robots["hyq"].reference_height < 0.8


def test_what_is_known_suffices_for_the_check(
    executive: Executive, ground: SurfaceArray, request_on_ground: Plan.Request
) -> None:
    """A sequence has no violations in the planner's environment, but has with a new obstacle."""
    set_surfaces(executive, ground)
    answer = executive.call(request_on_ground)
    known = environment(executive).environment
    assert checked(answer, known).valid
    where = answer.sequence.states[-1].root.position
    corners = ((-0.2, -0.2), (0.2, -0.2), (0.0, 0.2))
    vertices = [Point(x=where.x + x, y=where.y + y, z=where.z) for x, y in corners]
    mesh = Mesh(vertices=vertices, triangles=[MeshTriangle(vertex_indices=[0, 1, 2])])
    ground.obstacles = [Obstacle(id="plate", mesh=mesh)]
    set_surfaces(executive, ground)
    known = environment(executive).environment
    entry = environment_entry(known).surfaces[-1]
    assert (entry.id, entry.friction) == ("plate/0", 0.0)
    kinds = {(v.state, v.kind) for v in checked(answer, known).violations}
    assert (len(answer.sequence.states) - 1, "collision") in kinds


def checked(answer: Plan.Response, known: SurfaceArray) -> CheckReport:
    """Violations that the check finds in the planner's environment."""
    plan = plan_of_messages(answer.sequence, answer.guide, environment_entry(known))
    return check_plan(plan)
