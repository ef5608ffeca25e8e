"""Random messages give a value, or an error that names the field; nothing else."""

from __future__ import annotations

import math
import random
import re
from collections.abc import Callable, Sequence
from copy import deepcopy
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from geometry_msgs.msg import Point, Pose, Quaternion, Vector3
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from rbprm_msgs.action import PlanContacts
from rbprm_msgs.msg import (
    Contact,
    ContactSequence,
    ContactState,
    ExecutionState,
    Obstacle,
    PlanningResult,
    PolygonRing,
    RootBounds,
    Surface,
    SurfaceArray,
)
from rbprm_msgs.srv import Plan, Replan, SetEnvironment, Validate
from rclpy.action import ActionClient
from rclpy.serialization import deserialize_message, serialize_message
from shape_msgs.msg import Mesh, MeshTriangle
from visualization_msgs.msg import Marker, MarkerArray

from rbprm_core.errors import InvalidInput
from rbprm_core.plan_record import ContactPlan
from rbprm_core.replanning import state_from_plan, states_from_plan
from rbprm_core.robot import Robot, load_description
from rbprm_ros.conversions import (
    job_of_message,
    read_sequence,
    replan_job_of_message,
    update_of_markers,
    update_of_message,
    update_of_setting,
)
from rbprm_ros.environment.store import Environment
from rbprm_ros.errors import error_data
from rbprm_ros.planning.sequence import PublishedSequence
from rbprm_ros.rclpy_utils.qos import CALLS
from rbprm_ros.settings import parse_settings
from rbprm_ros.workers.jobs import Job
from rbprm_ros.workers.worker_process import MEASURED_STATE, SEQUENCE_STATES

if TYPE_CHECKING:
    from conftest import Executive, Process, Site

MANY = settings(
    max_examples=400,
    deadline=None,
    database=None,
    derandomize=True,
    suppress_health_check=list(HealthCheck),
    phases=[Phase.generate],  # seeds cannot be shrunk further, and tracing is slow
)
SETTINGS = parse_settings(
    {"max_surfaces": 50, "max_vertices": 100, "max_triangles": 100, "max_states": 100}
)
NODE = "/rbprm_planner"
LIMBS = 4  # limbs of HyQ
WAVES = 25  # of eight messages each, sent to a real node
MAX_GROWTH = 30.0  # megabytes over all waves
HUGE = 200  # entries of an array above the limits of the settings

FLOATS = (math.nan, math.inf, -math.inf, 0.0, -0.0, -1.0, 1.0, 1e-12, 5e-324, 1e5, -1e6, 1e308)
INTEGER = re.compile(r"(u?)int(\d+)")
ARRAY = re.compile(r"sequence<([\w/]+)(?:, (\d+))?>|([\w/]+)\[(\d+)\]")
TEXTS = ("", "map", "odom", "hyq", "lf_leg", "ground", "\0", "é☃", "../../etc/passwd", "x" * 5000)


class Spoiler:
    """Changes fields of messages at random.

    Args:
        number: returns a random number from 0 to one less than its argument.
    """

    def __init__(self, number: Callable[[int], int]) -> None:
        self._number = number

    def spoil(self, message: Any) -> Any:
        """A copy of a message with up to four fields changed."""
        copy = deepcopy(message)
        for _ in range(1 + self._number(4)):
            self._change_one(copy)
        return copy

    def _change_one(self, message: Any) -> None:
        """Change a field somewhere in a message: a plain value or an array."""
        while True:
            fields = message.get_fields_and_field_types()
            name = list(fields)[self._number(len(fields))]
            kind, value = fields[name], getattr(message, name)
            if hasattr(value, "get_fields_and_field_types"):
                message = value
            elif ARRAY.fullmatch(kind) and "/" in kind and len(value) and self._number(4):
                message = value[self._number(len(value))]
            else:
                setattr(message, name, self._value(kind, value))
                return

    def _value(self, kind: str, value: Any) -> Any:
        array, integer = ARRAY.fullmatch(kind), INTEGER.fullmatch(kind)
        if array is not None:
            entry = array[1] or array[3]
            if array[4]:
                return np.array([self._value(entry, 0) for _ in value], dtype=value.dtype)
            return self._array(entry, list(value), int(array[2] or HUGE))
        if integer is not None:
            bits = int(integer[2])
            low = 0 if integer[1] else -(2 ** (bits - 1))
            high = 2**bits - 1 + low
            return self._one_of((low, high, 0, 1, 2, 3, 11, 100, high // 2))
        if kind in ("double", "float"):
            return self._one_of(FLOATS)
        if kind == "boolean":
            return not value
        if kind == "string":
            return self._one_of(TEXTS)
        package, name = kind.split("/")
        return getattr(import_module(f"{package}.msg"), name)()

    def _array(self, entry: str, entries: list[Any], most: int) -> list[Any]:
        """An array with entries removed, doubled, reversed, replaced, or with very many entries."""
        strange = self._value(entry, 0)
        made = self._one_of(
            (
                [],
                entries * 2,
                entries[::-1],
                entries[:2],
                [*entries, strange],
                [strange] * most,
                [entries[0] if entries else strange] * most,
            )
        )
        return list(made[:most])

    def _one_of(self, pool: Sequence[Any]) -> Any:
        return pool[self._number(len(pool))]


def points(*corners: tuple[float, float, float]) -> list[Point]:
    return [Point(x=float(x), y=float(y), z=float(z)) for x, y, z in corners]


def make_surfaces() -> SurfaceArray:
    """A floor with a hole, a ramp, and an obstacle."""
    floor = points((-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0))
    hole = PolygonRing(vertices=points((1.5, 1.5, 0), (1.8, 1.5, 0), (1.8, 1.8, 0)))
    ramp = points((2, -1, 0), (3, -1, 0.2), (3, 1, 0.2), (2, 1, 0))
    face = MeshTriangle(vertex_indices=np.array([0, 1, 2], dtype=np.uint32))
    wall = Mesh(vertices=points((5, 0, 0), (5, 1, 0), (5, 0, 1)), triangles=[face])
    return SurfaceArray(
        surfaces=[
            Surface(id="ground", vertices=floor, holes=[hole], friction=0.5),
            Surface(id="ramp", vertices=ramp, friction=0.5),
        ],
        obstacles=[Obstacle(id="wall", mesh=wall)],
    )


def make_markers() -> MarkerArray:
    """Two triangles, and the removal of others."""
    mesh = Marker(ns="a", id=1, type=Marker.TRIANGLE_LIST, scale=Vector3(x=1.0, y=1.0, z=1.0))
    mesh.points = points((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 0, 0), (1, 1, 0), (0, 1, 0))
    return MarkerArray(markers=[mesh, Marker(ns="b", action=Marker.DELETE)])


def make_request() -> Plan.Request:
    """HyQ, a short way ahead."""
    message = Plan.Request(robot="hyq", time_limit=0.3, robustness_threshold=10.0)
    message.start.pose.position.z = message.goal.pose.position.z = 0.6
    message.goal.pose.position.x = 0.2
    message.bounds = RootBounds(
        low=Point(x=-1.0, y=-1.0, z=0.0), high=Point(x=1.0, y=1.0, z=1.0), yaw=0.1
    )
    message.required_limbs = ["lf_leg", "rf_leg"]
    message.gravity, message.grip_force = [Vector3(z=-9.81)], 10.0
    message.root_joints = []
    message.goal_limbs = message.start_limbs = ["lf_leg", "rf_leg", "lh_leg", "rh_leg"]
    return message


def make_goal() -> PlanContacts.Goal:
    """The same request as a goal of the action."""
    request = make_request()
    names = PlanContacts.Goal.get_fields_and_field_types()
    return PlanContacts.Goal(**{name: getattr(request, name) for name in names})


@pytest.fixture(scope="module")
def robot() -> Robot:
    return Robot.load(load_description("hyq"))


@pytest.fixture(scope="module")
def sequence(robot: Robot) -> ContactSequence:
    """Two readable states of HyQ, which are invalid everywhere."""
    joints = ((robot.low[7:] + robot.high[7:]) / 2).tolist()
    identity = Pose(orientation=Quaternion(w=1.0))
    contacts = [
        Contact(limb=limb.name, frame=limb.effector, pose=identity, frame_offset=identity,
                normal=Vector3(z=1.0), points=points((0, 0, 0)), friction=0.5, surface_id="ground")
        for limb in robot.limbs
    ]  # fmt: skip
    state = ContactState(root=identity, joint_positions=joints, robustness=9.0, contacts=contacts)
    return ContactSequence(
        robot="hyq", urdf="a.urdf", joint_names=robot.joint_names, start=identity, goal=identity,
        robustness_threshold=1.0, gravity=Vector3(z=-9.81), states=[state, deepcopy(state)],
    )  # fmt: skip


@pytest.fixture(scope="module")
def known() -> Environment:
    """The environment with the surfaces."""
    made = Environment()
    made.update(update_of_message(make_surfaces(), SETTINGS), SETTINGS)
    return made


@pytest.fixture(scope="module")
def base(sequence: ContactSequence, known: Environment) -> PublishedSequence:
    """A published sequence with those states."""
    job = job_of_message(make_request(), SETTINGS, known)
    return PublishedSequence(
        "an id", 0, 0, read_sequence(sequence, SETTINGS.max_states, LIMBS), job, 0, 0
    )


def value_or_field(message: Any, read: Callable[[Any], object]) -> object:
    """The value of a message; None where it is refused with the name of one of its fields."""
    try:
        return read(message)
    except InvalidInput as refused:
        error = refused
    failure = error_data(error)
    require_field(message, failure.field)
    assert failure.field in failure.text
    return None


def require_field(message: Any, path: str) -> None:
    """Fail where a message has no field with a dotted path."""
    place = message
    for part in path.split("."):
        there = int(part) < len(place) if part.isdigit() else hasattr(place, part)
        assert there, f"{type(message).__name__} has no field {path!r}"
        place = place[int(part)] if part.isdigit() else getattr(place, part)


seeds = st.integers(min_value=0, max_value=2**63)


def spoiled(message: Any, seed: int) -> Any:
    """A message with some fields changed, after serialisation where that is possible."""
    made = Spoiler(random.Random(seed).randrange).spoil(message)
    return deserialize_message(serialize_message(made), type(made))


@MANY
@given(seed=seeds)
def test_surfaces(seed: int) -> None:
    environment = Environment()

    def read(message: SurfaceArray) -> object:
        return environment.update(update_of_message(message, SETTINGS), SETTINGS)

    read(make_surfaces())
    before = environment.snapshot
    if value_or_field(spoiled(make_surfaces(), seed), read) is None:
        assert environment.snapshot is before
    else:
        assert all(0 <= s.friction < math.inf for s in environment.snapshot.surfaces)


@MANY
@given(seed=seeds)
def test_markers(seed: int) -> None:
    environment = Environment()

    def read(message: MarkerArray) -> object:
        return environment.update(update_of_markers(message, SETTINGS), SETTINGS)

    value_or_field(spoiled(make_markers(), seed), read)


@MANY
@given(seed=seeds)
def test_setting_of_an_environment(seed: int) -> None:
    message = spoiled(SetEnvironment.Request(environment=make_surfaces()), seed)
    value_or_field(message, lambda m: update_of_setting(m, SETTINGS))


@MANY
@given(seed=seeds)
def test_requests(seed: int, known: Environment) -> None:
    for made in (make_request(), make_goal()):
        job = value_or_field(spoiled(made, seed), lambda m: job_of_message(m, SETTINGS, known))
        if isinstance(job, Job):
            assert 0 < job.time_limit < math.inf
            assert np.isfinite(job.request.start.position).all()
            assert (job.request.bounds.low <= job.request.bounds.high).all()


@MANY
@given(seed=seeds)
def test_sequences(seed: int, sequence: ContactSequence, robot: Robot) -> None:
    def read(message: Validate.Request) -> ContactPlan:
        plan = read_sequence(message.sequence, SETTINGS.max_states, LIMBS)
        states_from_plan(plan.states, robot, *SEQUENCE_STATES)
        return plan

    value_or_field(spoiled(Validate.Request(sequence=sequence), seed), read)


@MANY
@given(seed=seeds)
def test_replanning(
    seed: int, sequence: ContactSequence, robot: Robot, base: PublishedSequence, known: Environment
) -> None:
    def read(message: Replan.Request) -> Job:
        job = replan_job_of_message(message, base, 1, SETTINGS, known)
        assert job.snapshot is not None
        if job.measured:
            state_from_plan(job.kept[0], robot, job.snapshot.scene(), *MEASURED_STATE)
        return job

    request = Replan.Request(measured_state=sequence.states[:1], goal=[make_request().goal])
    value_or_field(spoiled(request, seed), read)


class Crowd:
    """Sends invalid messages to all interfaces of a real node, and waits for each answer."""

    def __init__(self, executive: Executive, sequence: ContactSequence) -> None:
        self._executive, self._sequence = executive, sequence
        self._random = random.Random(7)
        node = executive.node
        self._goals = ActionClient(node, PlanContacts, f"{NODE}/plan_contacts")
        self._topics = [
            (node.create_publisher(kind, f"{NODE}/{name}", CALLS), make)
            for kind, name, make in (
                (SurfaceArray, "surfaces", make_surfaces),
                (MarkerArray, "surface_markers", make_markers),
                (ExecutionState, "execution_state", ExecutionState),
            )
        ]
        executive.reach(self._goals, self._goals.server_is_ready, "the action")

    def send(self) -> None:
        """Send one message of each kind; fails where the answer is missing or is not an error."""
        measured = self._sequence.states[:1]
        setting = SetEnvironment.Request(environment=make_surfaces())
        for kind, name, message in (
            (Plan, "plan", make_request()),
            (Replan, "replan", Replan.Request(measured_state=measured, time_limit=0.3)),
            (Validate, "validate", Validate.Request(sequence=self._sequence)),
            (SetEnvironment, "set_environment", setting),
        ):
            request = self._spoilt(message)
            self._judge(request, self._executive.ask(kind, name, request).result)
        goal = self._spoilt(make_goal())
        sent = self._goals.send_goal_async(goal)
        self._executive.spin_until(sent.done, "an accepted goal")
        ended = sent.result().get_result_async()
        self._executive.spin_until(ended.done, "a result")
        self._judge(goal, ended.result().result.result)
        for publisher, make in self._topics:
            publisher.publish(self._spoilt(make()))

    def _spoilt(self, message: Any) -> Any:
        made = Spoiler(self._random.randrange).spoil(message)
        if getattr(made, "time_limit", 0.0) > 1.0:  # a long search is not a fault
            made.time_limit = 1.0
        return made

    def _judge(self, message: Any, result: PlanningResult) -> None:
        assert result.code not in (PlanningResult.INTERNAL, PlanningResult.WORKER_LOST), result.text
        if result.code == PlanningResult.INVALID_INPUT and result.field != "surfaces":
            require_field(message, result.field)


def memory(process: Process) -> float:
    """Resident memory of a process and its children, megabytes."""
    pids = [process.popen.pid, *process.children()]
    texts = [Path(f"/proc/{pid}/status").read_text() for pid in pids]
    return sum(int(re.findall(r"VmRSS:\s+(\d+)", text)[0]) for text in texts) / 1024


def test_node_answers_everything_and_stays_up(site: Site, sequence: ContactSequence) -> None:
    planner = site.planner("--ros-args", "-p", "time_limit:=0.5", "-p", "max_triangles:=1000")
    executive = site.executive()
    crowd = Crowd(executive, sequence)
    for _ in range(10):
        crowd.send()
    children, before = planner.children(), memory(planner)
    for _ in range(WAVES):
        crowd.send()
    grown = memory(planner) - before
    print(f"\n{before:.0f} MB; {grown:+.1f} MB after {8 * WAVES} spoilt messages")
    assert planner.children() == children
    assert grown < MAX_GROWTH
    assert "Traceback" not in planner.log.read_text()
    clean = SetEnvironment.Request(environment=make_surfaces())
    assert executive.ask(SetEnvironment, "set_environment", clean).result.code == 0
    assert executive.call(make_request()).result.code == PlanningResult.SUCCESS
