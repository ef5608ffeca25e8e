"""A planning process: serves the work that comes over a pipe, piece by piece, without ROS.

Started by `PlanningWorker` as `python -m rbprm_ros.workers.worker_process DESCRIPTOR ROLE`. It ends
when the node closes the pipe or exits.
"""

from __future__ import annotations

import contextlib
import signal
import sys
import time
import traceback
from collections import OrderedDict
from collections.abc import Sequence
from multiprocessing.connection import Connection

import numpy as np

from rbprm_core.body.state import State
from rbprm_core.budget import Budget, Progress
from rbprm_core.errors import Cancelled, InvalidInput, RbprmError
from rbprm_core.guide.root import RoadmapStore
from rbprm_core.plan_conversion.states_to_plan import contact_plan, partial_plan, state_entry
from rbprm_core.plan_record import ContactPlan, EnvironmentEntry, StateEntry
from rbprm_core.planner import plan
from rbprm_core.replanning import (
    InvalidState,
    Reason,
    ValidityMonitor,
    replan_from_one_of,
    state_from_plan,
    states_from_plan,
)
from rbprm_core.robot import Robot
from rbprm_core.robot.data import RobotData, load_robot_data
from rbprm_core.scene import Scene
from rbprm_ros.environment.snapshot_diff import SnapshotChange, changed
from rbprm_ros.environment.store import Snapshot
from rbprm_ros.failure import failure_of
from rbprm_ros.workers.jobs import (
    Cancellation,
    Done,
    Failed,
    Job,
    Preparation,
    Reported,
    Result,
    RobotChoice,
    Validation,
    Work,
)

MAX_ROBOTS = 4  # with their limbs, whose data are kept
REPORT_PERIOD = 0.05  # seconds; the planner tells its progress much more often than anyone looks
LISTEN_PERIOD = 0.01  # seconds between looks for a cancellation


class Server:
    """Holds what is kept from one piece of work to the next: robots, the scene, the watch, and
    roadmaps where jobs ask for it."""

    def __init__(self, pipe: Connection) -> None:
        self._pipe = pipe
        self._robots: OrderedDict[str, RobotData] = OrderedDict()  # by what their files say
        self._snapshot = Snapshot()
        self._scene: Scene | None = None  # made of it when it is first needed
        self._watch: ValidityMonitor | None = None
        self._watched_key = ""
        self._roadmaps: RoadmapStore | None = None

    def serve(self) -> None:
        """Serve until the pipe closes, which raises `EOFError` or `ConnectionError`."""
        while True:
            message = self._pipe.recv()
            if isinstance(message, SnapshotChange):
                self._snapshot, self._scene = changed(self._snapshot, message), None
            elif isinstance(message, Preparation | Job | Validation):
                self._pipe.send(self._answer(message))

    def _answer(self, work: Work) -> Done | Failed:
        """Do a piece of work; whatever goes wrong is an answer too."""
        line = Line(self._pipe, work.id)
        try:
            return Done(work.id, self._result(work, line))
        except (EOFError, ConnectionError):  # the node is gone: nobody to answer
            raise
        except PartlyDone as error:
            return Failed(work.id, failure_of(error.cause), error.partial)
        except RbprmError as error:
            return Failed(work.id, failure_of(error))
        except Exception as error:  # a bug of ours: told, and the next piece may still do
            traceback.print_exc()
            return Failed(work.id, failure_of(error))

    def _result(self, work: Work, line: Line) -> Result:
        data = self._robot(work.robot, line)
        match work:
            case Job():
                return self._plan(work, data, line)
            case Validation():
                return self._invalid(work, data)
        return None

    def _known(self) -> Scene | None:
        """The scene of now; None where there is nothing."""
        if self._scene is None and (self._snapshot.surfaces or self._snapshot.obstacles):
            self._scene = self._snapshot.scene()
        return self._scene

    def _robot(self, choice: RobotChoice, line: Line) -> RobotData:
        description = choice.description()
        key = description.model_dump_json()  # not the name: its file may have been edited
        if key not in self._robots:
            started = time.monotonic()

            def report(fraction: float) -> None:
                line.report(Progress("robot data", fraction, 0, time.monotonic() - started))
                if line.cancelled():
                    raise Cancelled("robot data")

            self._robots[key] = load_robot_data(Robot.load(description), report)
            if len(self._robots) > MAX_ROBOTS:
                self._robots.popitem(last=False)
        self._robots.move_to_end(key)
        return self._robots[key]

    def _plan(self, job: Job, data: RobotData, line: Line) -> ContactPlan:
        scene = self._known()
        if scene is None:
            raise InvalidInput("surfaces", [], "the planning process was given none")
        grown = GrownStates(line, data.robot) if job.shown else None
        budget = Budget(job.time_limit, line.cancelled, line.report)
        request, environment = job.request, self._snapshot.entry
        roadmaps = self._kept_roadmaps(job)
        try:
            if not job.kept:
                outcome = plan(request, data, scene, budget, roadmaps, on_states=grown)
                return contact_plan(outcome, request, data.robot, environment)
            kept: tuple[State, ...]
            if job.measured:
                kept = (state_from_plan(job.kept[-1], data.robot, scene, "measured_state.0"),)
            else:
                kept = states_from_plan(job.kept, data.robot, "sequence.states")
            candidates = job.candidates or (len(kept) - 1,)
            revision = replan_from_one_of(
                kept, candidates, request, data, scene, budget, grown, roadmaps
            )
        except RbprmError as error:
            raise PartlyDone(error, _partial(job, error, data, environment)) from error
        found = contact_plan(revision.outcome, request, data.robot, environment)
        return _joined(job, found, revision.first_changed)

    def _kept_roadmaps(self, job: Job) -> RoadmapStore | None:
        """Those of the jobs before, where this one is to have them; else they are forgotten."""
        if not job.keep_roadmaps:
            self._roadmaps = None
        elif self._roadmaps is None:
            self._roadmaps = RoadmapStore()
        return self._roadmaps

    def _invalid(self, work: Validation, data: RobotData) -> tuple[InvalidState, ...]:
        if work.states is not None:
            states = states_from_plan(work.states, data.robot, "sequence.states")
            gravity = np.array(work.gravity)
            self._watch = ValidityMonitor(data, states, work.threshold, gravity, work.grip_force)
            self._watched_key = work.key
        assert self._watch is not None
        assert self._watched_key == work.key  # the node sees to it
        scene = self._known()
        if scene is None:
            return _lost(self._watch.states, work.first)
        return self._watch.invalid(scene, work.first)


def _lost(states: Sequence[State], first: int) -> tuple[InvalidState, ...]:
    """What there is to say of states where there is no surface at all."""
    return tuple(
        InvalidState(i, Reason.SURFACE_LOST, "", "", f"state {i}: there are no surfaces")
        for i, state in enumerate(states)
        if i >= first and state.contacts
    )


class PartlyDone(Exception):
    """Planning failed after some states."""

    def __init__(self, cause: RbprmError, partial: ContactPlan | None) -> None:
        self.cause, self.partial = cause, partial


class GrownStates:
    """Told the states of a sequence as it grows; hands their entries on with the next report."""

    def __init__(self, line: Line, robot: Robot) -> None:
        self._line, self._robot = line, robot
        self._entries: list[tuple[State, StateEntry]] = []

    def __call__(self, states: Sequence[State]) -> None:
        """Take the states so far."""
        if self._line.due():
            common = 0
            for (known, _), state in zip(self._entries, states, strict=False):
                if known is not state:
                    break
                common += 1
            added = [(state, state_entry(self._robot, state)) for state in states[common:]]
            self._entries[common:] = added
            self._line.states = tuple(entry for _, entry in self._entries)


class Line:
    """The pipe during one piece of work: progress goes out, a cancellation comes in."""

    def __init__(self, pipe: Connection, work_id: str) -> None:
        self._pipe, self._id = pipe, work_id
        self._cancelled = False
        self._stage = ""
        self._next_report = self._next_look = 0.0
        self.states: tuple[StateEntry, ...] | None = None
        """Of the sequence so far, for the next report."""

    def due(self) -> bool:
        """Whether the next report will be sent."""
        return time.monotonic() >= self._next_report

    def report(self, progress: Progress) -> None:
        """Tell the node, at most once in a period and a stage."""
        if progress.stage == self._stage and not self.due():
            return
        self._stage, self._next_report = progress.stage, time.monotonic() + REPORT_PERIOD
        self._pipe.send(Reported(self._id, progress, self.states))
        self.states = None

    def cancelled(self) -> bool:
        """Whether the node has asked to stop."""
        now = time.monotonic()
        if now >= self._next_look:
            self._next_look = now + LISTEN_PERIOD
            while self._pipe.poll():
                message = self._pipe.recv()
                assert isinstance(message, Cancellation)  # the node waits with all else
                self._cancelled |= message.id == self._id
        return self._cancelled


def _partial(
    job: Job, error: RbprmError, data: RobotData, environment: EnvironmentEntry
) -> ContactPlan | None:
    """The states up to where a job ended; None where there are none, or nobody waits for them."""
    if len(job.candidates) > 1:
        return None
    found = partial_plan(error, job.request, data.robot, environment)
    if found is None or not job.kept or job.measured:
        return found
    return found.model_copy(update={"states": (*job.kept, *found.states[len(job.kept) :])})


def _joined(job: Job, found: ContactPlan, first_changed: int) -> ContactPlan:
    """A plan that begins with the last state that was kept, after those that were kept.

    What was kept stays as it was, to the last digit; a measured state, as it was laid.
    """
    if job.measured:
        return found
    return found.model_copy(update={"states": (*job.kept[:first_changed], *found.states[1:])})


def main() -> None:
    """Serve the pipe whose file descriptor is the argument."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the node, which then ends us
    with contextlib.suppress(EOFError, ConnectionError):
        Server(Connection(int(sys.argv[1]))).serve()


if __name__ == "__main__":
    main()
