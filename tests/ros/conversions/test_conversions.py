"""Conversion of messages to core types and back."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from geometry_msgs.msg import Point, Vector3
from rbprm_msgs.msg import InvalidState as InvalidStateMessage
from rbprm_msgs.msg import PlannerStatus, PlanningResult, SurfaceArray
from rbprm_msgs.srv import Plan
from rclpy.serialization import deserialize_message, serialize_message
from std_msgs.msg import Header

from rbprm_core.check import check_plan
from rbprm_core.check.violation import Kind
from rbprm_core.errors import (
    ErrorCode,
    InvalidInput,
    NoSequenceFound,
    StartUnreachable,
    TimeLimitReached,
)
from rbprm_core.failures import Cause, Failure
from rbprm_core.guide.root_space import RootBounds
from rbprm_core.placement import Placement
from rbprm_core.plan_record import (
    ContactEntry,
    ContactPlan,
    EnvironmentEntry,
    Pose,
    RequestEntry,
    RobotEntry,
    StageNamesEntry,
    StateEntry,
    Statistics,
    SurfaceEntry,
)
from rbprm_core.replanning import InvalidState, Reason
from rbprm_core.request import PlanRequest, StageNames
from rbprm_core.scene import make_surface
from rbprm_ros.conversions import (
    guide_message,
    invalid_state_messages,
    job_of_message,
    plan_of_messages,
    read_sequence,
    request_message,
    result_message,
    sequence_message,
    statistics_message,
    success_message,
    surfaces_message,
    update_of_message,
)
from rbprm_ros.environment.store import Environment
from rbprm_ros.environment.updates import SurfaceUpdate
from rbprm_ros.errors import ErrorData, NodeCode, error_data
from rbprm_ros.planning.status import Activity
from rbprm_ros.settings import Settings, parse_settings
from rbprm_ros.workers.jobs import RobotChoice

CORE_DATA = Path(__file__).parents[2] / "core" / "data"
TURNED = (0.0, 0.0, math.sin(0.3), math.cos(0.3))  # 0.6 rad about z
LIMBS = ("lf_leg", "rf_leg", "lh_leg", "rh_leg")
TORSO = ("torso_1_joint", "torso_2_joint")
SQUARE = ((0.0, 0.0, 0.0), (2.0, 0.0, 0.0), (2.0, 2.0, 0.0), (0.0, 2.0, 0.0))
HOLE = ((0.5, 0.5, 0.0), (1.0, 0.5, 0.0), (1.0, 1.0, 0.0))


def across(message):  # type: ignore[no-untyped-def]
    """A message after serialisation and deserialisation."""
    return deserialize_message(serialize_message(message), type(message))


@pytest.fixture
def plan() -> ContactPlan:
    """A plan with one state and a different value in every field."""
    pose = Pose(position=(1.0, 2.0, 3.0), orientation=TURNED)
    contact = ContactEntry(
        limb="lf_leg", frame="lf_foot", frame_offset=pose, type="planar", position=(4.0, 5.0, 6.0),
        orientation=TURNED, normal=(0.0, 0.0, 1.0), friction=0.4, surface="step_3",
        points=((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 0.0)),
    )  # fmt: skip
    state = StateEntry(
        root=pose, joints=(0.1, -0.2), com=(7.0, 8.0, 9.0), robustness=12.5, contacts=(contact,)
    )
    return ContactPlan(
        robot=RobotEntry(name="hyq", urdf="a.urdf", srdf="a.srdf", joint_names=("j1", "j2")),
        environment=EnvironmentEntry(surfaces=(SurfaceEntry(id="step_3", vertices=SQUARE),)),
        request=RequestEntry(
            start=pose,
            goal=pose,
            seed=2**63 + 1,
            robustness_threshold=3.5,
            gravity=(0.0, 1.0, -9.0),
            grip_force=7.0,
            goal_limbs=("rf_leg", "lf_leg"),
            position_tolerance=0.021,
            orientation_tolerance=0.002,
            stages=StageNamesEntry(guide="prm", contacts="along_guide"),
        ),
        guide=(pose, pose),
        states=(state,),
        statistics=Statistics(
            time={"prepare": 0.4, "guide": 0.1, "shortcut": 0.2, "sequence": 0.3, "total": 1.0},
            counts={"guides": 2, "guide_nodes": 4, "states": 1},
        ),
    )


def test_plan_survives_the_messages(plan: ContactPlan) -> None:
    header = Header(frame_id="map")
    sequence = across(sequence_message(plan, header, "an id", 1_500_000_000))
    guide, statistics = across(guide_message(plan, header)), across(statistics_message(plan))
    assert (sequence.sequence_id, sequence.revision) == ("an id", 0)
    assert (sequence.surfaces_stamp.sec, sequence.surfaces_stamp.nanosec) == (1, 500_000_000)
    assert guide.poses[1].header.frame_id == "map"
    assert (sequence.goal_limbs, sequence.missing_goal_limbs) == (["rf_leg", "lf_leg"], ["rf_leg"])
    assert plan_of_messages(sequence, guide, plan.environment, statistics) == plan


def test_the_tolerance_at_the_goal_is_the_same_over_the_wire() -> None:
    """A root 1 cm from the goal, as `sequence.root_slack` allows; by default it is 1 mm."""
    plan = ContactPlan.read(CORE_DATA / "version_1.plan.json")
    x, y, z = plan.request.goal.position
    goal = plan.request.goal.model_copy(update={"position": (x + 0.01, y, z)})
    changes = {"goal": goal, "position_tolerance": 0.011}
    plan = plan.model_copy(update={"request": plan.request.model_copy(update=changes)})
    sequence, guide = (
        across(sequence_message(plan, Header(), "id", 0)),
        guide_message(plan, Header()),
    )
    assert check_plan(plan).valid
    assert check_plan(plan_of_messages(sequence, guide, plan.environment)).valid
    assert read_sequence(sequence, max_states=10, limbs=4).request.position_tolerance == 0.011
    sequence.position_tolerance = 0.0
    strict = check_plan(plan_of_messages(sequence, guide, plan.environment))
    assert {violation.kind for violation in strict.violations} == {Kind.GOAL}


def test_robot_without_srdf(plan: ContactPlan) -> None:
    bare = plan.model_copy(update={"robot": plan.robot.model_copy(update={"srdf": None})})
    header = Header()
    sequence = sequence_message(bare, header, "", 0)
    again = plan_of_messages(sequence, guide_message(bare, header), bare.environment)
    assert again.robot.srdf is None


def test_surfaces_survive_the_messages() -> None:
    surface = make_surface("a", SQUARE, 0.7, (HOLE,))
    update = update_of_message(
        across(surfaces_message([surface], Header(frame_id="map"))), Settings()
    )
    (again,) = Environment().update(update, Settings()).surfaces
    assert (again.id, again.friction, again.kind) == ("a", 0.7, surface.kind)
    assert again.polygon.area == pytest.approx(surface.polygon.area)
    assert np.allclose(again.polygon.boundary, surface.polygon.boundary)
    assert np.allclose(again.polygon.holes[0], surface.polygon.holes[0])


@pytest.mark.parametrize("frame", ["", "map"])
def test_frames_that_mean_the_planning_frame(frame: str) -> None:
    update_of_message(SurfaceArray(header=Header(frame_id=frame)), Settings())


def test_stamp_that_is_no_time() -> None:
    message = SurfaceArray()
    message.header.stamp.nanosec = 1_000_000_000
    with pytest.raises(InvalidInput) as caught:
        update_of_message(message, Settings())
    assert caught.value.field == "header.stamp.nanosec"


@pytest.fixture
def environment() -> Environment:
    made = Environment()
    made.update(SurfaceUpdate((SurfaceEntry(id="a", vertices=SQUARE),)), Settings())
    return made


@pytest.fixture
def request_made() -> PlanRequest:
    return PlanRequest(
        start=Placement.parse((0.0, 0.1, 0.6)),
        goal=Placement.parse((1.0, 0.2, 0.7), TURNED),
        bounds=RootBounds(np.array([-1.0, -2.0, 0.1]), np.array([3.0, 4.0, 1.0]), np.full(3, 0.9)),
        required_limbs=LIMBS,
        start_limbs=LIMBS[:3],
        robustness_threshold=5.0,
        seed=11,
        gravity=np.array([0.0, 0.0, -1.62]),
        grip_force=7.0,
        goal_limbs=LIMBS[:2],
        stages=StageNames(guide="prm"),
    )


def test_request_survives_the_messages(request_made: PlanRequest, environment: Environment) -> None:
    message = across(request_message(request_made, "anymal", 12.0))
    job = job_of_message(message, Settings(), environment)
    assert (job.robot, job.time_limit) == (RobotChoice("anymal"), 12.0)
    assert job.snapshot is environment.snapshot
    again = job.request
    assert np.array_equal(again.goal.position, request_made.goal.position)
    assert np.allclose(again.goal.orientation, request_made.goal.orientation)
    assert np.array_equal(again.bounds.low, request_made.bounds.low)
    assert np.array_equal(again.bounds.half_ranges, request_made.bounds.half_ranges)
    assert (again.required_limbs, again.start_limbs) == (LIMBS, LIMBS[:3])
    assert (again.seed, again.robustness_threshold) == (11, 5.0)
    assert (again.gravity.tolist(), again.grip_force) == ([0.0, 0.0, -1.62], 7.0)
    assert again.goal_limbs == LIMBS[:2]
    assert again.stages == StageNames("prm", "along_guide")


def test_joints_planned_with_the_root_reach_the_job(
    request_made: PlanRequest, environment: Environment
) -> None:
    message = request_message(request_made, "talos", 12.0)
    message.limbs, message.root_joints = ["left_leg", "right_leg"], list(TORSO)
    message.required_limbs, message.start_limbs, message.goal_limbs = [], [], []
    job = job_of_message(across(message), Settings(), environment)
    assert job.robot == RobotChoice("talos", ("left_leg", "right_leg"), TORSO)
    assert job.robot.description().root_joints == TORSO


@pytest.mark.parametrize(
    ("names", "field", "reason"),
    [
        (["torso_1_joint", "wing"], "root_joints.1", "unknown joint"),
        (["torso_1_joint", "torso_1_joint"], "root_joints.1", "named twice"),
        (["torso_1_joint", "leg_left_4_joint"], "root_joints.1", "a joint of limb left_leg"),
    ],
)
def test_joints_that_cannot_be_planned_with_the_root(
    names: list[str], field: str, reason: str, environment: Environment
) -> None:
    message = Plan.Request(robot="talos", root_joints=names)
    with pytest.raises(InvalidInput) as caught:
        job_of_message(message, Settings(), environment)
    assert caught.value.field == field
    assert reason in caught.value.reason


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"gravity": [Vector3(x=math.nan)]}, "gravity.0.x"),
        ({"gravity": [Vector3(z=-101.0)]}, "gravity.0.z"),
        ({"grip_force": -1.0}, "grip_force"),
        ({"grip_force": 1e-9}, "grip_force"),
        ({"grip_force": math.inf}, "grip_force"),
        ({"limbs": ["lf_leg", "rf_leg", "lf_leg"]}, "limbs"),
        ({"limbs": ["lf_leg"] * 100_000}, "limbs"),
        ({"required_limbs": ["lf_leg", "lf_leg"]}, "required_limbs.1"),
        ({"start_limbs": ["lf_leg"] * 100_000}, "start_limbs.1"),
        ({"goal_limbs": ["lf_leg", "rf_leg", "rf_leg"]}, "goal_limbs.2"),
        ({"root_joints": ["lf_haa_joint"] * 100_000}, "root_joints.99999"),
        ({"guide_planner": "astar"}, "guide_planner"),
        ({"contact_planner": "astar"}, "contact_planner"),
    ],
)
def test_what_a_request_may_not_say(
    changes: dict[str, object], field: str, environment: Environment
) -> None:
    with pytest.raises(InvalidInput) as caught:
        job_of_message(Plan.Request(robot="hyq", **changes), Settings(), environment)
    assert caught.value.field == field


def test_each_known_robot_is_listed_once(environment: Environment) -> None:
    with pytest.raises(InvalidInput) as caught:
        job_of_message(Plan.Request(robot="spot"), Settings(), environment)
    assert caught.value.field == "robot"
    assert caught.value.reason.count("hyq") == 1


def test_defaults_of_a_request(request_made: PlanRequest, environment: Environment) -> None:
    settings = parse_settings({"time_limit": 5.0, "robustness_threshold": 8.0})
    message = type(request_message(request_made, "", 0.0))()
    job = job_of_message(message, settings, environment)
    assert (job.time_limit, job.request.robustness_threshold) == (5.0, 8.0)
    assert (job.request.gravity.tolist(), job.request.grip_force) == ([0.0, 0.0, -9.81], 10.0)
    assert not job.keep_roadmaps
    assert job.request.stages == StageNames()
    prm = parse_settings({"stages": {"guide": "prm"}})
    assert job_of_message(message, prm, environment).request.stages.guide == "prm"
    keeping = parse_settings({"keep_roadmaps": True})
    assert job_of_message(message, keeping, environment).keep_roadmaps
    assert job.request.required_limbs == job.request.start_limbs == LIMBS
    assert job.request.bounds.low.tolist() == [-1.0, -1.0, -1.0]
    assert job.request.bounds.high.tolist() == [3.0, 3.0, 1.0]


def test_as_many_contacts_as_limbs_and_few_points(plan: ContactPlan) -> None:
    message = sequence_message(plan, Header(), "id", 0)
    contacts = message.states[0].contacts
    assert read_sequence(message, max_states=10, limbs=1).states == plan.states
    message.states[0].contacts = [*contacts, *contacts]
    with pytest.raises(InvalidInput) as caught:
        read_sequence(message, max_states=10, limbs=1)
    assert caught.value.field == "sequence.states.0.contacts"
    contacts[0].points = [Point()] * 17
    message.states[0].contacts = contacts
    with pytest.raises(InvalidInput) as caught:
        read_sequence(message, max_states=10, limbs=1)
    assert caught.value.field == "sequence.states.0.contacts.0.points"


@pytest.mark.parametrize("value", [-1.0, 2e6, math.inf, math.nan])
def test_a_sequences_threshold_is_a_force_that_can_be(plan: ContactPlan, value: float) -> None:
    message = sequence_message(plan, Header(), "id", 0)
    message.robustness_threshold = value
    with pytest.raises(InvalidInput) as caught:
        read_sequence(message, max_states=10, limbs=4)
    assert caught.value.field == "sequence.robustness_threshold"


def test_success_says_what_was_asked_for_and_is_not_there(plan: ContactPlan) -> None:
    asked = plan.request.model_copy(update={"robustness_threshold": 20.0})
    lacking = success_message(plan.model_copy(update={"request": asked}))
    assert lacking.code == PlanningResult.SUCCESS
    assert "the minimum robustness is 12.5 N, below the requested 20 N" in lacking.text
    assert lacking.text.endswith("without contact in the last state: rf_leg")
    asked = plan.request.model_copy(update={"goal_limbs": ("lf_leg",)})
    assert success_message(plan.model_copy(update={"request": asked})).text == ""


def constants(message: type) -> dict[str, int]:
    """The constants of a message by name."""
    return {
        name: getattr(message, name)
        for name in dir(type(message))
        if name[0].isupper() and name.isupper()
    }


def test_constants_of_messages_equal_the_enumerations() -> None:
    codes = {code.name: code.value for code in (*ErrorCode, *NodeCode)}
    causes = {f"CAUSE_{cause.name}": cause.value for cause in Cause}
    assert constants(PlanningResult) == codes | causes
    assert constants(InvalidStateMessage) == {reason.name: reason.value for reason in Reason}
    assert constants(PlannerStatus) == {activity.name: activity.value for activity in Activity}
    assert max(ErrorCode) < 100 <= min(NodeCode)


def test_cause_and_progress_of_a_failure_are_in_the_result() -> None:
    failure = Failure.of(Cause.NO_EQUILIBRIUM, "lf_leg")
    start = across(result_message(error_data(StartUnreachable(failure))))
    assert (start.code, start.cause) == (
        PlanningResult.START_UNREACHABLE,
        PlanningResult.CAUSE_NO_EQUILIBRIUM,
    )
    assert (start.limb, start.state) == ("lf_leg", -1)
    stopped = across(result_message(error_data(NoSequenceFound(4, failure, 0.25))))
    assert (stopped.cause, stopped.limb) == (PlanningResult.CAUSE_NO_EQUILIBRIUM, "lf_leg")
    assert (stopped.state, stopped.fraction) == (4, 0.25)
    late = across(result_message(error_data(TimeLimitReached(1.0, "guide"))))
    assert (late.cause, late.limb) == (PlanningResult.CAUSE_UNSPECIFIED, "")


def test_causes_of_invalid_states() -> None:
    lost = InvalidState(3, Failure.of(Cause.SURFACE_LOST, "lf_leg", surface="s", x=0, y=0, z=0))
    (message,) = invalid_state_messages([lost])
    assert (message.index, message.reason) == (3, InvalidStateMessage.SURFACE_LOST)
    assert message.cause == PlanningResult.CAUSE_SURFACE_LOST
    assert (message.limb, message.surface_id) == ("lf_leg", "s")
    assert "lf_leg" in message.text


def test_results() -> None:
    success = result_message()
    assert (success.code, success.state, success.fraction) == (PlanningResult.SUCCESS, -1, 1.0)
    assert success.text == ""
    failure = error_data(InvalidInput("a.b", [math.nan] * 1000, "must be finite"))
    message = across(result_message(failure))
    assert (message.code, message.field) == (PlanningResult.INVALID_INPUT, "a.b")
    assert len(message.value) < 300
    assert error_data(ZeroDivisionError("x")) == ErrorData(
        error_data(ZeroDivisionError("x")).code, "a fault of the planner: ZeroDivisionError: x"
    )
