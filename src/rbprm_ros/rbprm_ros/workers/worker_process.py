"""A worker process: does the work that it receives, piece after piece, without ROS.

`PlanningWorker` starts it as `python -m rbprm_ros.workers.worker_process DESCRIPTOR ROLE`. It ends
when the node closes the channel or exits.
"""

from __future__ import annotations

import time
import traceback
from collections import OrderedDict
from collections.abc import Sequence

import numpy as np

from rbprm_core.body.state import State
from rbprm_core.body.state_failures import surface_lost
from rbprm_core.budget import Budget, Progress
from rbprm_core.errors import Cancelled, InvalidInput, RbprmError
from rbprm_core.guide.root import RoadmapStore
from rbprm_core.plan_conversion import StateFields
from rbprm_core.plan_conversion.states_to_plan import contact_plan, partial_plan, with_states
from rbprm_core.plan_record import ContactPlan, EnvironmentEntry
from rbprm_core.planner import plan
from rbprm_core.processes import Channel, ChannelClosed, serve_parent
from rbprm_core.replanning import (
    InvalidState,
    ValidityMonitor,
    replan_from_one_of,
    state_from_plan,
    states_from_plan,
)
from rbprm_core.robot import Robot
from rbprm_core.robot.data import RobotData, load_robot_data
from rbprm_core.scene import Scene
from rbprm_ros.environment.snapshot import Snapshot
from rbprm_ros.environment.snapshot_diff import SnapshotDiff, apply_diff
from rbprm_ros.errors import error_data
from rbprm_ros.workers.jobs import (
    Done,
    Failed,
    Job,
    Preparation,
    Result,
    RobotChoice,
    Validation,
    Work,
)
from rbprm_ros.workers.reporting import GrowingStates, WorkLink

CONTACT_STATE = StateFields(
    joints="joint_positions",
    position="pose.position",
    orientation="pose.orientation",
    surface="surface_id",
)
"""Names of the fields of a state in the messages ContactState and Contact."""
SEQUENCE_STATES = ("sequence.states", CONTACT_STATE)
MEASURED_STATE = ("measured_state.0", CONTACT_STATE)

MAX_ROBOTS = 4  # robots, each with its choice of limbs, whose data are kept


class PartlyDone(Exception):
    """Planning failed after it had found some states.

    Attributes:
        cause: the error of the planner.
        partial: plan of the states; None where there are none.
    """

    def __init__(self, cause: RbprmError, partial: ContactPlan | None) -> None:
        self.cause, self.partial = cause, partial


class Server:
    """Does work, and keeps robots, scene, monitored states and roadmaps from one piece to the next.

    Args:
        channel: connection to the node.
    """

    def __init__(self, channel: Channel) -> None:
        self._channel = channel
        self._robots: OrderedDict[str, RobotData] = OrderedDict()  # by description
        self._snapshot = Snapshot()
        self._scene: Scene | None = None  # of the snapshot, made when it is first needed
        self._monitor: ValidityMonitor | None = None
        self._monitor_key = ""
        self._roadmaps: RoadmapStore | None = None

    def serve(self) -> None:
        """Do the work that comes, until the channel closes.

        Raises:
            ChannelClosed: the node has closed the channel.
        """
        while True:
            message = self._channel.receive()
            if isinstance(message, SnapshotDiff):
                self._snapshot, self._scene = apply_diff(self._snapshot, message), None
            elif isinstance(message, Preparation | Job | Validation):
                self._channel.send(self._answer(message))

    def _answer(self, work: Work) -> Done | Failed:
        """Do some work; every error is an answer too."""
        link = WorkLink(self._channel, work.id)
        try:
            return Done(work.id, self._result(work, link))
        except ChannelClosed:
            raise
        except PartlyDone as error:
            return Failed(work.id, error_data(error.cause), error.partial)
        except RbprmError as error:
            return Failed(work.id, error_data(error))
        except Exception as error:  # a fault of the planner; the next work may succeed
            traceback.print_exc()
            return Failed(work.id, error_data(error))

    def _result(self, work: Work, link: WorkLink) -> Result:
        data = self._robot_data(work.robot, link)
        match work:
            case Job():
                return self._plan(work, data, link)
            case Validation():
                return self._invalid_states(work, data)
        return None

    def _current_scene(self) -> Scene | None:
        """The scene of the newest snapshot; None where that is empty."""
        if self._scene is None and (self._snapshot.surfaces or self._snapshot.obstacles):
            self._scene = self._snapshot.scene()
        return self._scene

    def _robot_data(self, choice: RobotChoice, link: WorkLink) -> RobotData:
        description = choice.description()
        key = description.model_dump_json()  # not the name: its file may have been edited
        if key not in self._robots:
            started = time.monotonic()

            def report(fraction: float) -> None:
                link.report(Progress("robot data", fraction, 0, time.monotonic() - started))
                if link.cancelled():
                    raise Cancelled("robot data")

            self._robots[key] = load_robot_data(Robot.load(description), report)
            if len(self._robots) > MAX_ROBOTS:
                self._robots.popitem(last=False)
        self._robots.move_to_end(key)
        return self._robots[key]

    def _plan(self, job: Job, data: RobotData, link: WorkLink) -> ContactPlan:
        """Plan, or replan from one of the candidates of a job.

        Raises:
            PartlyDone: planning failed.
        """
        scene = self._current_scene()
        if scene is None:
            raise InvalidInput("surfaces", [], "the planning process has received none")
        on_states = GrowingStates(link, data.robot) if job.shown else None
        budget = Budget(job.time_limit, link.cancelled, link.report)
        request, environment = job.request, self._snapshot.entry
        roadmaps = self._kept_roadmaps(job)
        try:
            if not job.kept:
                outcome = plan(request, data, scene, budget, roadmaps, on_states=on_states)
                return contact_plan(outcome, request, data.robot, environment)
            kept: tuple[State, ...]
            if job.measured:
                kept = (state_from_plan(job.kept[-1], data.robot, scene, *MEASURED_STATE),)
            else:
                kept = states_from_plan(job.kept, data.robot, *SEQUENCE_STATES)
            candidates = job.candidates or (len(kept) - 1,)
            revision = replan_from_one_of(
                kept, candidates, request, data, scene, budget, on_states, roadmaps
            )
        except RbprmError as error:
            raise PartlyDone(error, _partial(job, error, data, environment)) from error
        found = contact_plan(revision.outcome, request, data.robot, environment)
        return _joined(job, found, revision.first_changed)

    def _kept_roadmaps(self, job: Job) -> RoadmapStore | None:
        """The roadmaps of earlier jobs; None, and they are dropped, where the job wants none."""
        if not job.keep_roadmaps:
            self._roadmaps = None
        elif self._roadmaps is None:
            self._roadmaps = RoadmapStore()
        return self._roadmaps

    def _invalid_states(self, work: Validation, data: RobotData) -> tuple[InvalidState, ...]:
        if work.states is not None:
            states = states_from_plan(work.states, data.robot, *SEQUENCE_STATES)
            gravity = np.array(work.gravity)
            self._monitor = ValidityMonitor(
                data, states, work.min_robustness, gravity, work.grip_force
            )
            self._monitor_key = work.key
        assert self._monitor is not None
        assert self._monitor_key == work.key  # `PlanningWorker` keeps track of what is held here
        scene = self._current_scene()
        if scene is None:
            return _all_lost(self._monitor.states, work.first, data.robot)
        return self._monitor.invalid(scene, work.first)


def _all_lost(states: Sequence[State], first: int, robot: Robot) -> tuple[InvalidState, ...]:
    """The invalid states where there are no surfaces: all that have contacts."""
    return tuple(
        InvalidState(i, surface_lost(robot.limbs[state.contacts[0].limb].name, state.contacts[0]))
        for i, state in enumerate(states)
        if i >= first and state.contacts
    )


def _partial(
    job: Job, error: RbprmError, data: RobotData, environment: EnvironmentEntry
) -> ContactPlan | None:
    """Plan of the states found before an error; None where there are none, or no caller waits."""
    if len(job.candidates) > 1:
        return None
    found = partial_plan(error, job.request, data.robot, environment)
    if found is None or not job.kept or job.measured:
        return found
    return with_states(found, (*job.kept, *found.states[len(job.kept) :]))


def _joined(job: Job, found: ContactPlan, first_changed: int) -> ContactPlan:
    """A replan with the kept states before it.

    Kept states stay as they were, to the last digit. A measured state has been moved onto its
    surfaces; the replan begins with the moved one.
    """
    if job.measured:
        return found
    return with_states(found, (*job.kept[:first_changed], *found.states[1:]))


def serve(channel: Channel) -> None:
    """Do the work that comes over a channel.

    Args:
        channel: connection to the node.
    """
    Server(channel).serve()


if __name__ == "__main__":
    serve_parent(serve)
