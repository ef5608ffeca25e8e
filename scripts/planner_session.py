"""A planner's process, a client of it and a field of tiles to plan on, for `measure_node.py`.

The process is started as on a robot, and talked to by DDS only.
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
TIMEOUT = 60.0  # seconds; what takes longer is a failure
GRACE = 1.0  # seconds without news after which the planner is asked whether a plan stands
SEARCH_LIMIT = 30.0  # seconds of a search that finds nothing
NUMBERS = itertools.count()  # of sessions: each planner has a name of its own in the ROS graph

# HyQ walks 3 m over a row of tiles amid others; to the island beyond no step leads.
LENGTH, WIDTH, COLUMNS = 0.25, 1.2, 20  # of a tile, metres; tiles in a row
INNER = range(7, 13)  # columns that the way leads over, not near its ends
HEIGHT = 0.6  # of HyQ's root, metres
GOAL, ISLAND = 3.0, 9.0  # x of the roots, metres
THRESHOLD = 10.0  # least b0, newtons


@contextmanager
def planner(robot: str = "hyq", parameters: Sequence[str] = ()) -> Iterator[Session]:
    """A planner that would plan at once; its process ends with the block.

    Args:
        parameters: of the planner, "NAME:=VALUE".
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
    """What came of an edit: seconds until INVALIDATED, and until the revision; None without one."""

    invalidated: float | None
    revised: float | None

    @property
    def failed(self) -> bool:
        """Whether states were lost and no revision came."""
        return self.invalidated is not None and self.revised is None


class Session:
    """A planner's process, and a client of it.

    Args:
        parameters: of the planner, "NAME:=VALUE".

    Attributes:
        executed: state that the robot was told to be in. version: of the environment as sent.
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
            # The planner's second reader wants latched messages, by intention: no warning.
            event_callbacks=PublisherEventCallbacks(use_default_callbacks=False),
        )

    def start(self) -> None:
        """Wait until the planner would plan at once."""
        self.client.wait_for_planner(TIMEOUT)
        heard = self._surfaces.get_subscription_count
        self.wait(lambda: heard() > 0, "subscriber of the surfaces")
        self.wait(lambda: "process is ready" in self.log(), "planner")

    def log(self) -> str:
        """What the planner has written."""
        return Path(self._log.name).read_text()

    def close(self) -> None:
        """Leave nothing behind."""
        self.process.terminate()
        try:
            self.process.wait(10.0)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        self.spinner.close()
        self._log.close()

    def wait(self, done: Callable[[], Any], what: str, timeout: float = TIMEOUT) -> None:
        """Serve callbacks until something is true; PlannerTimeout where it never is."""
        self.client.wait_until(lambda: bool(done()), what, timeout)

    def send(self, *added: Surface, removed: Sequence[str] = (), is_diff: bool = True) -> None:
        """Publish surfaces: a change, of which each counts as a version."""
        message = SurfaceArray(is_diff=is_diff, surfaces=added, removed_ids=removed)
        message.header.stamp = self.node.get_clock().now().to_msg()
        self._surfaces.publish(message)
        self.version += 1

    def see(self, publish: Callable[[], object]) -> None:
        """Have a whole environment published, and wait until the planner has it."""
        before = self.client.environment().environment_version
        publish()
        self.wait(lambda: self.client.environment().environment_version > before, "surfaces")
        self.version = self.client.environment().environment_version

    def plan(self, request: Plan.Request) -> None:
        """Plan, and wait until the sequence is published and stands."""
        answer = self.client.plan(request).result(request.time_limit + TIMEOUT)
        if answer.result.code != PlanningResult.SUCCESS:
            raise RuntimeError(f"no plan: {answer.result.text}")
        identity, self.executed = answer.sequence.sequence_id, 0
        self.wait(lambda: self._published(identity) and self._stands(), "the sequence")

    def search(self, time_limit: float = SEARCH_LIMIT) -> PlanCall:
        """Begin to search a way to the island; returns when the planner is at full load."""
        call = self.client.plan(way(ISLAND, time_limit))

        def searching() -> bool:
            return call.feedback is not None and call.feedback.stage == "guide"

        self.wait(lambda: searching() or call.done, "search")
        if call.done:
            raise RuntimeError(f"no search, but: {call.result(0.0).result.text}")
        return call

    def execute(self, state: int) -> None:
        """Tell the planner where the robot is, and wait until it has taken note."""
        self.executed = state
        self.client.executed(self.client.sequence, state)
        self.wait(lambda: self.client.status.executed_state == state, "notice of the state")

    def react(self, publish: Callable[[], object]) -> Reaction:
        """Have an edit published, and wait until the planner is through with it."""
        told, published, start = len(self.statuses), len(self.sequences), time.perf_counter()
        publish()
        self.spinner.spin_until(lambda: self.told_since(told) is not None, GRACE)
        if self.told_since(told) is None:
            self.wait_for_environment()
            request = Validate.Request(from_state=self.executed)
            if self.client.validate(request).valid and self.told_since(told) is None:
                return Reaction(None, None)
        self.wait(lambda: self.told_since(told) is not None, "INVALIDATED")
        self.wait(self._rests, "end of the replanning")
        when = [t for t, sequence in self.sequences[published:] if sequence.complete]
        return Reaction(self.told_since(told) - start, when[0] - start if when else None)

    def told_since(self, index: int, state: int = PlannerStatus.INVALIDATED) -> float | None:
        """When a status was first told, of those from an index on."""
        return next((t for t, status in self.statuses[index:] if status.state == state), None)

    def settle(self) -> None:
        """Wait until the published sequence stands on all that was sent."""
        self.wait_for_environment()
        self.client.validate()  # answered in turn: looks that were begun before are over
        self.wait(self._stands, "a sequence that stands")

    def wait_for_environment(self) -> None:
        """Wait until the planner has taken in what was sent."""
        known = self.client.environment
        self.wait(lambda: known().environment_version >= self.version, "surfaces taken in")

    def workers(self) -> dict[str, int]:
        """Ids of the planner's processes that are alive, by what they are for."""
        tasks = Path(f"/proc/{self.process.pid}/task").glob("*/children")
        ids = [int(pid) for task in tasks for pid in task.read_text().split()]
        return {Path(f"/proc/{i}/cmdline").read_text().split("\0")[-2]: i for i in ids}

    def _published(self, identity: str) -> bool:
        return {self.client.sequence.sequence_id, self.client.status.sequence_id} == {identity}

    def _stands(self) -> bool:
        return self._rests() and self.client.status.state == PlannerStatus.VALID

    def _rests(self) -> bool:
        status, sequence = self.client.status, self.client.sequence
        resting = status.state in (PlannerStatus.VALID, PlannerStatus.FAILED)
        return resting and sequence.revision == status.revision and self._has_guide()

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
    """The tiles, whole rows of them, and the island: about so many surfaces."""
    rows = max(1, round(count / COLUMNS))
    tiles = [
        tile(f"{row}/{column}", LENGTH * (column - 3.5), WIDTH * row)
        for row, column in itertools.product(range(rows), range(COLUMNS))
    ]
    return {surface.id: surface for surface in (*tiles, tile("island", ISLAND, 0.0, 2.0, 2.0))}


def way(x: float, time_limit: float = TIMEOUT) -> Plan.Request:
    """The request that HyQ goes from the origin to a root at some x."""
    start, goal = (
        PoseStamped(pose=Pose(position=Point(x=at, z=HEIGHT), orientation=Quaternion(w=1.0)))
        for at in (0.0, x)
    )
    return Plan.Request(
        robot="hyq", start=start, goal=goal, time_limit=time_limit, robustness_threshold=THRESHOLD
    )
