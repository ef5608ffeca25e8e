"""Fixtures with real processes over DDS; each test module has a domain of its own."""

from __future__ import annotations

import contextlib
import fcntl
import itertools
import os
import signal
import subprocess
import tempfile
import time
from array import array
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import IO, Any

import pytest
import rclpy
from ament_index_python import get_package_prefix
from geometry_msgs.msg import Point, Pose, PoseStamped, Quaternion
from lifecycle_msgs.srv import GetState
from nav_msgs.msg import Path as PathMessage
from rbprm_msgs.msg import (
    ContactSequence,
    PlannerStatus,
    PlanningResult,
    Surface,
    SurfaceArray,
)
from rbprm_msgs.srv import GetEnvironment, Plan, SetEnvironment
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile

from rbprm_ros.rclpy_utils.qos import CALLS, LATCHED, LATCHED_STREAM

os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"  # for tests and started processes

NODE = "/rbprm_planner"
EXECUTABLES = Path(get_package_prefix("rbprm_ros")) / "lib" / "rbprm_ros"
START_TIMEOUT = 90.0  # seconds; like the others far more than a busy machine needs
ANSWER_TIMEOUT = 90.0
PROBE_PERIOD = 2.0  # seconds until a probe without an answer is sent again
STOP_TIMEOUT = 30.0
DOMAINS = itertools.count(os.getpid())
ENDLESS = ("--ros-args", "-p", "guide.rrt.iterations:=1000000000")
"""Arguments of a planner whose searches end by their time limits only."""


class Process:
    """A running executable of the built workspace."""

    def __init__(self, domain: int, folder: Path, name: str, *arguments: str) -> None:
        environment = {
            **os.environ,
            "ROS_DOMAIN_ID": str(domain),
            "ROS_LOG_DIR": str(folder),
        }
        self.log = folder / f"{name}_{time.monotonic_ns()}.log"
        with self.log.open("wb") as log:
            self.popen = subprocess.Popen(
                [EXECUTABLES / name, *arguments],
                stdout=log,
                stderr=subprocess.STDOUT,
                env=environment,
            )

    def wait_for(self, text: str, count: int = 1) -> None:
        """Wait until the process has logged a text a number of times."""
        wait_until(lambda: self.log.read_text().count(text) >= count, f"{text!r} in {self.log}")

    def children(self) -> list[int]:
        """Ids of the child processes that are alive."""
        tasks = Path(f"/proc/{self.popen.pid}/task").glob("*/children")
        return [int(pid) for task in tasks for pid in task.read_text().split()]

    def worker(self, purpose: str = "planning") -> int:
        """Id of the planner's process for a purpose, "planning" or "validating"."""
        while True:
            wait_until(lambda: len(self.workers(purpose)) == 1, f"a {purpose} process")
            with contextlib.suppress(ValueError):  # it has ended meanwhile
                (found,) = self.workers(purpose)
                return found

    def workers(self, purpose: str) -> list[int]:
        """Ids of the running processes for a purpose."""
        return [pid for pid in self.children() if role(pid) == purpose]

    def stop(self, number: int = signal.SIGINT, timeout: float = STOP_TIMEOUT) -> int:
        """Send a signal; returns the exit code."""
        self.popen.send_signal(number)
        return self.popen.wait(timeout)


def role(pid: int) -> str:
    """The purpose of a child process of the planner: the last word of its command line."""
    try:
        words = Path(f"/proc/{pid}/cmdline").read_text().split("\0")
    except OSError:  # it has ended
        return ""
    return words[-2] if len(words) > 1 else ""


class Executive:
    """A client of the planner, like a mission executive."""

    def __init__(self, context: Context) -> None:
        self.node = Node("executive", context=context)
        self.executor = SingleThreadedExecutor(context=context)
        self.executor.add_node(self.node)
        self.client = self.node.create_client(Plan, f"{NODE}/plan", qos_profile=CALLS)
        self.sequences: list[ContactSequence] = []
        self.guides: list[PathMessage] = []
        self.statuses: list[PlannerStatus] = []
        self._clients: dict[str, Any] = {}
        self._publishers: dict[str, Any] = {}
        self._reached: dict[Any, set[tuple[int, ...]]] = {}  # planners that discovered a client

    def listen(self) -> None:
        """Collect the messages on the latched topics from now on."""
        for kind, topic, kept in (
            (ContactSequence, "contact_sequence", self.sequences),
            (PathMessage, "guide_path", self.guides),
            (PlannerStatus, "status", self.statuses),
        ):
            self.node.create_subscription(kind, f"{NODE}/{topic}", kept.append, LATCHED_STREAM)

    def wait_for_planner(self) -> None:
        """Wait until the plan service is ready."""
        self.reach(self.client, self.client.service_is_ready, "the plan service")

    def reach(self, client: Any, ready: Callable[[], bool], what: str) -> None:
        """Wait until the server of a client is ready and its answers will reach the client.

        A server that is ready for a client may not have discovered the client's reader of answers,
        and the answer to a first call would be lost. DDS announces the readers of a participant in
        the order of their creation: the answer to a read-only call of a client made later, which is
        repeated until then, shows that the planner has discovered this one.
        """
        self.spin_until(ready, what, START_TIMEOUT)
        planners = self._planners()
        if planners and planners <= self._reached.get(client, set()):
            return
        probe = self.node.create_client(GetState, f"{NODE}/get_state", qos_profile=CALLS)
        self.spin_until(probe.service_is_ready, "the service get_state", START_TIMEOUT)
        end, calls = time.monotonic() + START_TIMEOUT, []
        while not any(call.done() for call in calls):
            assert time.monotonic() < end, f"no answer of get_state within {START_TIMEOUT} s"
            calls.append(probe.call_async(GetState.Request()))
            again = time.monotonic() + PROBE_PERIOD
            while not any(call.done() for call in calls) and time.monotonic() < again:
                self.executor.spin_once(0.02)
        self.node.destroy_client(probe)
        self._reached[client] = planners

    def _planners(self) -> set[tuple[int, ...]]:
        """DDS identifiers of the planners: those of their status publishers."""
        found = self.node.get_publishers_info_by_topic(f"{NODE}/status")
        return {tuple(info.endpoint_gid) for info in found}

    def publish(self, message: SurfaceArray, qos: QoSProfile = LATCHED) -> None:
        """Publish surfaces, as soon as the planner subscribes."""
        key = str(qos.durability)
        if key not in self._publishers:
            topic = f"{NODE}/surfaces"
            self._publishers[key] = self.node.create_publisher(SurfaceArray, topic, qos)
        publisher = self._publishers[key]
        self.spin_until(lambda: publisher.get_subscription_count() > 0, "a subscriber")
        publisher.publish(message)

    def start_call(self, request: Plan.Request) -> Any:
        """Call the plan service; returns the future."""
        self.wait_for_planner()
        return self.client.call_async(request)

    def answer(self, future: Any, timeout: float = ANSWER_TIMEOUT) -> Plan.Response:
        """The answer to a call."""
        self.spin_until(future.done, "an answer", timeout)
        return future.result()

    def call(self, request: Plan.Request, timeout: float = ANSWER_TIMEOUT) -> Plan.Response:
        """Call the plan service and wait."""
        return self.answer(self.start_call(request), timeout)

    def start_asking(self, kind: Any, name: str, request: Any) -> Any:
        """Call a service of the planner, such as "validate"; returns the future."""
        if name not in self._clients:
            client = self.node.create_client(kind, f"{NODE}/{name}", qos_profile=CALLS)
            self._clients[name] = client
        client = self._clients[name]
        self.reach(client, client.service_is_ready, f"the service {name}")
        return client.call_async(request)

    def ask(self, kind: Any, name: str, request: Any, timeout: float = ANSWER_TIMEOUT) -> Any:
        """Call a service of the planner and wait."""
        future = self.start_asking(kind, name, request)
        self.spin_until(future.done, f"an answer of {name}", timeout)
        return future.result()

    def known(self) -> set[str]:
        """Ids of the surfaces that the planner knows."""
        answer = self.ask(GetEnvironment, "get_environment", GetEnvironment.Request())
        return {surface.id for surface in answer.environment.surfaces}

    def give(self, surfaces: SurfaceArray) -> None:
        """Set the planner's environment."""
        request = SetEnvironment.Request(environment=surfaces)
        answer = self.ask(SetEnvironment, "set_environment", request)
        assert answer.result.code == PlanningResult.SUCCESS, answer.result.text

    def call_on_surfaces(self, request: Plan.Request) -> Plan.Response:
        """Call until the planner knows the surfaces, which have been sent."""
        end = time.monotonic() + START_TIMEOUT
        while True:
            response = self.call(request)
            if response.result.field != "surfaces" or time.monotonic() > end:
                return response

    def spin_until(
        self, done: Callable[[], bool], what: str, timeout: float = START_TIMEOUT
    ) -> None:
        """Run callbacks until a condition holds; the test fails where it never does."""
        end = time.monotonic() + timeout
        while not done():
            assert time.monotonic() < end, f"no {what} within {timeout} s"
            self.executor.spin_once(0.02)

    def close(self) -> None:
        """Destroy the node."""
        self.executor.shutdown()
        self.node.destroy_node()


def wait_until(done: Callable[[], bool], what: str, timeout: float = START_TIMEOUT) -> None:
    """Wait until a condition holds, without running callbacks."""
    end = time.monotonic() + timeout
    while not done():
        assert time.monotonic() < end, f"no {what} within {timeout} s"
        time.sleep(0.02)


class Site:
    """A ROS domain that no other test run on this machine uses, and the processes in it."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.domain, self._lock = _claim_domain()
        self.context = Context()
        rclpy.init(context=self.context, domain_id=self.domain)
        self.processes: list[Process] = []
        self._executives: list[Executive] = []

    def start(self, name: str, *arguments: str) -> Process:
        """Start an executable."""
        self.processes.append(Process(self.domain, self.folder, name, *arguments))
        return self.processes[-1]

    def planner(self, *arguments: str) -> Process:
        """Start a planner node and wait until it is ready to plan."""
        process = self.start("planner_node", *arguments)
        process.wait_for("process is ready")
        return process

    def executive(self) -> Executive:
        """Make a client."""
        self._executives.append(Executive(self.context))
        return self._executives[-1]

    def close(self) -> None:
        """End all processes and nodes."""
        for process in self.processes:
            process.popen.terminate()
        for process in self.processes:
            try:
                process.popen.wait(STOP_TIMEOUT)
            except subprocess.TimeoutExpired:  # another test reports that
                process.popen.kill()
                process.popen.wait(STOP_TIMEOUT)
        for executive in self._executives:
            executive.close()
        rclpy.try_shutdown(context=self.context)
        self._lock.close()


def _claim_domain() -> tuple[int, IO[str]]:
    """A domain and the locked file that reserves it.

    Each call gives another domain, since DDS takes seconds to discover participants in a domain
    that others have just left.
    """
    for _ in range(100):
        number = 1 + next(DOMAINS) % 100
        file = (Path(tempfile.gettempdir()) / f"rbprm_test_domain_{number}.lock").open("w")
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            file.close()
            continue
        return number, file
    raise RuntimeError("all ROS domains from 1 to 100 are in use")


@pytest.fixture
def site(tmp_path: Path) -> Iterator[Site]:
    """A domain for one test."""
    made = Site(tmp_path)
    yield made
    made.close()


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    """A domain with a planner node, shared by the tests of a module."""
    made = Site(tmp_path_factory.mktemp("shared"))
    made.planner(*ENDLESS)
    yield made
    made.close()


@pytest.fixture(scope="module")
def managed(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    """A domain with a planner node that waits for a lifecycle manager."""
    made = Site(tmp_path_factory.mktemp("managed"))
    level = ("--log-level", "rbprm_planner:=debug")
    made.start("planner_node", *ENDLESS, "-p", "autostart:=false", *level)
    yield made
    made.close()


@pytest.fixture
def executive(shared: Site) -> Executive:
    """A client of the shared planner."""
    return shared.executive()


def square(identity: str, half: float, z: float = 0.0, friction: float = 0.5) -> Surface:
    """A horizontal square about the origin, facing up."""
    corners = ((-half, -half), (half, -half), (half, half), (-half, half))
    vertices = [Point(x=x, y=y, z=z) for x, y in corners]
    return Surface(id=identity, vertices=vertices, friction=friction)


@pytest.fixture
def ground() -> SurfaceArray:
    """Flat ground, ten metres wide."""
    return SurfaceArray(surfaces=[square("ground", 5.0)])


@pytest.fixture
def request_on_ground() -> Plan.Request:
    """HyQ, one metre ahead on flat ground."""
    return Plan.Request(start=stamped(0.0), goal=stamped(1.0), robustness_threshold=10.0)


@pytest.fixture
def gap() -> SurfaceArray:
    """Flat ground with a gap of three metres, before x = 4, that no step crosses."""
    here, there = square("here", 1.0), square("there", 1.0)
    for point in there.vertices:
        point.x += 5.0
    return SurfaceArray(surfaces=[here, there])


@pytest.fixture
def request_over_gap(request_on_ground: Plan.Request) -> Plan.Request:
    """A request for which the planner searches until its time limit."""
    request_on_ground.goal.pose.position.x = 5.0
    request_on_ground.time_limit = 30.0
    return request_on_ground


def stamped(x: float) -> PoseStamped:
    """A root pose of HyQ standing on flat ground."""
    position, upright = Point(x=x, y=0.0, z=0.6), Quaternion(w=1.0)
    return PoseStamped(pose=Pose(position=position, orientation=upright))


@pytest.fixture(scope="session")
def plain() -> Callable[[Any], Any]:
    """A function that converts a message to types of JSON."""

    def convert(value: Any) -> Any:
        if hasattr(value, "get_fields_and_field_types"):
            names = value.get_fields_and_field_types()
            return {name: convert(getattr(value, name)) for name in names}
        if isinstance(value, list | tuple | array):
            return [convert(item) for item in value]
        return value

    return convert
