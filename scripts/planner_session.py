"""A planner's process, a client of it, and a field of tiles to plan on, for `measure_node.py`.

The process is started as on a robot, and reached over DDS only.
"""

from __future__ import annotations

import itertools
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ament_index_python import get_package_prefix
from geometry_msgs.msg import Point, Pose, PoseStamped, Quaternion
from nav_msgs.msg import Path as PathMessage
from rbprm_msgs.msg import ContactSequence, PlannerStatus, PlanningResult, Surface, SurfaceArray
from rbprm_msgs.srv import Plan, Validate
from rclpy.event_handler import PublisherEventCallbacks
from rclpy.node import Node

from rbprm_ros.client import PlanCall, PlannerClient, PlannerTimeout
from rbprm_ros.rclpy_utils.qos import LATCHED_STREAM, STREAM
from rbprm_ros.rclpy_utils.spinning import Spinner, init

EXECUTABLE = Path(get_package_prefix("rbprm_ros")) / "lib" / "rbprm_ros" / "planner_node"
TIMEOUT = 60.0  # seconds, after which an action has failed
GRACE = 1.0  # seconds without a status after which a sequence is validated
SEARCH_LIMIT = 30.0  # seconds of a search without result
NUMBERS = itertools.count()  # of sessions; each planner has another name in the ROS graph

# HyQ walks 3 m over a row of tiles among others; the island beyond is out of reach.
LENGTH, WIDTH, COLUMNS = 0.25, 1.2, 20  # length and width of a tile, metres; tiles in a row
INNER = range(7, 13)  # columns in the middle of the way
HEIGHT = 0.6  # height of HyQ's root, metres
GOAL, ISLAND = 3.0, 9.0  # x of the root at the goals, metres
THRESHOLD = 10.0  # minimum b0, newtons


@contextmanager
def planner(robot: str = "hyq", parameters: Sequence[str] = ()) -> Iterator[Session]:
    """A planner that is ready to plan; its process ends with the block.

    Args:
        robot: name of the robot.
        parameters: parameters of the planner, "NAME:=VALUE".
    """
    session = Session(robot, parameters)
    try:
        session.start()
        yield session
    except (PlannerTimeout, RuntimeError):
        print(session.log(), file=sys.stderr)
        raise
    finally:
        session.close()


@dataclass(frozen=True)
class Reaction:
    """The planner's reaction to an edit.

    Attributes:
        invalidated: seconds until INVALIDATED; None without that status.
        revised: seconds until the revision; None without one.
    """

    invalidated: float | None
    revised: float | None

    @property
    def failed(self) -> bool:
        """Whether states became invalid and no revision came."""
        return self.invalidated is not None and self.revised is None


class Session:
    """A planner's process, and a client of it.

    Args:
        robot: name of the robot.
        parameters: parameters of the planner, "NAME:=VALUE".

    Attributes:
        executed: index of the reported executed state.
        version: version of the environment after all sent changes.
    """

    def __init__(self, robot: str = "hyq", parameters: Sequence[str] = ()) -> None:
        self.name = f"/rbprm_measured_{os.getpid()}_{next(NUMBERS)}"
        self._log = tempfile.NamedTemporaryFile("w+", suffix=".log")  # noqa: SIM115
        self.executed = self.version = 0
        self.statuses: list[tuple[float, PlannerStatus]] = []
        self.sequences: list[tuple[float, ContactSequence]] = []
        self.guide = PathMessage()
        command = [EXECUTABLE, "--ros-args", "-r", f"__node:={self.name[1:]}"]
        for parameter in (f"robot:={robot}", *parameters):
            command += ["-p", parameter]
        self.process = subprocess.Popen(command, stdout=self._log, stderr=subprocess.STDOUT)
        init()
        self.node = Node(f"measuring_{os.getpid()}")
        self.spinner = Spinner(self.node)
        self.client = PlannerClient(self.node, self.name, self.spinner.spin_until)
        self.client.watch(
            lambda message: self.sequences.append((time.perf_counter(), message)),
            lambda message: self.statuses.append((time.perf_counter(), message)),
        )
        self.node.create_subscription(
            PathMessage, f"{self.name}/guide_path", self._take_guide, LATCHED_STREAM
        )
        self._surfaces = self.node.create_publisher(
            SurfaceArray,
            f"{self.name}/surfaces",
            STREAM,
            # The planner's second reader requests latched messages, by design: no warning.
            event_callbacks=PublisherEventCallbacks(use_default_callbacks=False),
        )

    def start(self) -> None:
        """Wait until the planner is ready to plan."""
        self.client.wait_for_planner(TIMEOUT)
        subscribers = self._surfaces.get_subscription_count
        self.wait(lambda: subscribers() > 0, "subscriber of the surfaces")
        self.wait(lambda: "process is ready" in self.log(), "planner")

    def log(self) -> str:
        """The planner's log."""
        return Path(self._log.name).read_text()

    def close(self) -> None:
        """End the process and destroy the node."""
        self.process.terminate()
        try:
            self.process.wait(10.0)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        self.spinner.close()
        self._log.close()

    def wait(self, done: Callable[[], Any], what: str, timeout: float = TIMEOUT) -> None:
        """Run callbacks until a condition holds; PlannerTimeout where it never does."""
        self.client.wait_until(lambda: bool(done()), what, timeout)

    def send(self, *added: Surface, removed: Sequence[str] = (), is_diff: bool = True) -> None:
        """Publish a change of the surfaces, which makes a new version of the environment."""
        message = SurfaceArray(is_diff=is_diff, surfaces=added, removed_ids=removed)
        message.header.stamp = self.node.get_clock().now().to_msg()
        self._surfaces.publish(message)
        self.version += 1

    def publish_environment(self, publish: Callable[[], object]) -> None:
        """Publish a whole environment, and wait until the planner knows it."""
        before = self.client.environment().environment_version
        publish()
        self.wait(lambda: self.client.environment().environment_version > before, "surfaces")
        self.version = self.client.environment().environment_version

    def plan(self, request: Plan.Request) -> None:
        """Plan, and wait until the sequence is published and valid."""
        answer = self.client.plan(request).result(request.time_limit + TIMEOUT)
        if answer.result.code != PlanningResult.SUCCESS:
            raise RuntimeError(f"no plan: {answer.result.text}")
        identity, self.executed = answer.sequence.sequence_id, 0
        self.wait(lambda: self._published(identity) and self._is_valid(), "the sequence")

    def search(self, time_limit: float = SEARCH_LIMIT) -> PlanCall:
        """Begin to search a guide path to the island; returns when the planner is at full load."""
        call = self.client.plan(way(ISLAND, time_limit))

        def searching() -> bool:
            return call.feedback is not None and call.feedback.stage == "guide"

        self.wait(lambda: searching() or call.done, "search")
        if call.done:
            raise RuntimeError(f"no search, but: {call.result(0.0).result.text}")
        return call

    def execute(self, state: int) -> None:
        """Report the executed state, and wait until it is in the status."""
        self.executed = state
        self.client.executed(self.client.sequence, state)
        self.wait(lambda: self.client.status.executed_state == state, "the state in the status")

    def react(self, publish: Callable[[], object]) -> Reaction:
        """Publish an edit, and wait until the planner has completed its reaction."""
        statuses, published, start = len(self.statuses), len(self.sequences), time.perf_counter()
        publish()
        self.spinner.spin_until(lambda: self.time_of_status(statuses) is not None, GRACE)
        if self.time_of_status(statuses) is None:
            self.wait_for_environment()
            request = Validate.Request(from_state=self.executed)
            if self.client.validate(request).valid and self.time_of_status(statuses) is None:
                return Reaction(None, None)
        self.wait(lambda: self.time_of_status(statuses) is not None, "INVALIDATED")
        self.wait(self._is_idle, "end of the replanning")
        when = [t for t, sequence in self.sequences[published:] if sequence.complete]
        return Reaction(self.time_of_status(statuses) - start, when[0] - start if when else None)

    def time_of_status(self, index: int, state: int = PlannerStatus.INVALIDATED) -> float | None:
        """Time of the first status with a state, from an index on; None where there is none."""
        return next((t for t, status in self.statuses[index:] if status.state == state), None)

    def settle(self) -> None:
        """Wait until the published sequence is valid on all sent surfaces."""
        self.wait_for_environment()
        self.client.validate()  # answered in turn, after validations that began before
        self.wait(self._is_valid, "a valid sequence")

    def wait_for_environment(self) -> None:
        """Wait until the planner has accepted all sent changes."""
        known = self.client.environment
        self.wait(lambda: known().environment_version >= self.version, "accepted surfaces")

    def workers(self) -> dict[str, int]:
        """Ids of the planner's running processes by purpose."""
        tasks = Path(f"/proc/{self.process.pid}/task").glob("*/children")
        ids = [int(pid) for task in tasks for pid in task.read_text().split()]
        return {Path(f"/proc/{i}/cmdline").read_text().split("\0")[-2]: i for i in ids}

    def _published(self, identity: str) -> bool:
        return {self.client.sequence.sequence_id, self.client.status.sequence_id} == {identity}

    def _is_valid(self) -> bool:
        return self._is_idle() and self.client.status.state == PlannerStatus.VALID

    def _is_idle(self) -> bool:
        status, sequence = self.client.status, self.client.sequence
        idle = status.state in (PlannerStatus.VALID, PlannerStatus.FAILED)
        return idle and sequence.revision == status.revision and self._has_guide()

    def _has_guide(self) -> bool:
        return self.guide.header.stamp == self.client.sequence.header.stamp

    def _take_guide(self, message: PathMessage) -> None:
        self.guide = message


def tile(name: str, x: float, y: float, length: float = LENGTH, width: float = WIDTH) -> Surface:
    """A horizontal tile of the ground around a point."""
    corners = ((-1, -1), (1, -1), (1, 1), (-1, 1))
    vertices = [Point(x=x + i * length / 2, y=y + k * width / 2, z=0.0) for i, k in corners]
    return Surface(id=name, vertices=vertices, friction=0.5)


def field(count: int) -> dict[str, Surface]:
    """Tiles in whole rows, and the island: about a number of surfaces."""
    rows = max(1, round(count / COLUMNS))
    tiles = [
        tile(f"{row}/{column}", LENGTH * (column - 3.5), WIDTH * row)
        for row, column in itertools.product(range(rows), range(COLUMNS))
    ]
    return {surface.id: surface for surface in (*tiles, tile("island", ISLAND, 0.0, 2.0, 2.0))}


def way(x: float, time_limit: float = TIMEOUT) -> Plan.Request:
    """The request for HyQ to go from the origin to a value of x."""
    start, goal = (
        PoseStamped(pose=Pose(position=Point(x=at, z=HEIGHT), orientation=Quaternion(w=1.0)))
        for at in (0.0, x)
    )
    return Plan.Request(
        robot="hyq", start=start, goal=goal, time_limit=time_limit, robustness_threshold=THRESHOLD
    )
