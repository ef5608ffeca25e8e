"""The node's planning, between its interfaces and its worker processes.

Everything runs in the executor's thread, as coroutines that await the two processes. One process
plans; the other validates the published sequence, so that validation never waits for a plan.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future as WorkFuture

from rclpy.executors import Executor
from rclpy.impl.rcutils_logger import RcutilsLogger

from rbprm_ros.environment.store import Environment
from rbprm_ros.planning.calls import PlanningCalls
from rbprm_ros.planning.monitor import SequenceMonitor
from rbprm_ros.planning.sequence import PublishedSequence
from rbprm_ros.planning.status_tracker import StatusTracker
from rbprm_ros.planning.validator import Validator, ignore
from rbprm_ros.settings import Settings
from rbprm_ros.workers.jobs import Result, RobotChoice
from rbprm_ros.workers.worker import PlanningWorker, Report


class Planning:
    """The worker processes and what uses them.

    Args:
        settings: returns the current parameters.
        now: returns the ROS time, nanoseconds.
        environment: the environment.
        executor: returns the executor that runs the callbacks.
        on_published: called with every new revision.
        on_status: called after every change of status or sequence.
        log: called with the progress of loading the robot's data.

    Attributes:
        tracker: the published sequence and the status.
        validator: validates sequences.
        monitor: publishes and monitors sequences.
        calls: serves calls for plans.
    """

    def __init__(
        self,
        settings: Callable[[], Settings],
        now: Callable[[], int],
        environment: Environment,
        executor: Callable[[], Executor],
        on_published: Callable[[PublishedSequence], None],
        on_status: Callable[[], None],
        log: Report,
    ) -> None:
        robot = RobotChoice(settings().robot)
        self._environment = environment
        self._planner = PlanningWorker(robot, log)
        self._validating = PlanningWorker(robot, ignore, "validating")
        self.tracker = StatusTracker(on_status)
        self.validator = Validator(self._validating, environment, executor)
        self.monitor = SequenceMonitor(
            settings,
            now,
            environment,
            executor,
            self._planner,
            self.validator,
            self.tracker,
            on_published,
        )
        self.calls = PlanningCalls(
            now, executor, self._planner, self.validator, self.tracker, self.monitor
        )

    @property
    def published(self) -> PublishedSequence | None:
        """The published sequence; None before the first."""
        return self.tracker.published

    @property
    def processes_alive(self) -> bool:
        """Whether both processes are running."""
        return self._planner.alive and self._validating.alive

    @property
    def restarts(self) -> int:
        """Number of processes that were lost."""
        return self._planner.restarts + self._validating.restarts

    def prepare(self, log: RcutilsLogger) -> None:
        """Start both processes and load the default robot's data.

        Args:
            log: logger that reports when planning is ready, or why it is not.
        """

        def on_ready(work: WorkFuture[Result]) -> None:
            error = work.exception() if not work.cancelled() else None
            if error is None:
                log.info("the planning process is ready")
            else:
                log.error(f"the planning process is not ready: {error}")

        self._planner.prepare().add_done_callback(on_ready)
        self._validating.prepare()

    def activate(self) -> None:
        """Serve calls, and keep the published sequence valid."""
        self.tracker.activate(self._environment.version)
        self.monitor.surfaces_changed()  # they may have, while the node was not active

    def deactivate(self) -> None:
        """Cancel all planning; the published sequence stays."""
        self.tracker.deactivate()
        self.calls.cancel_all()
        self.monitor.cancel_replanning()

    def close(self) -> None:
        """End both processes; work under way ends as cancelled."""
        self.tracker.deactivate()
        self._planner.close()
        self._validating.close()
