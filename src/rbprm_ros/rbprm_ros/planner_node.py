"""The planner's node: names, quality of service, and callbacks that delegate."""

from __future__ import annotations

import sys
import threading
import traceback
from concurrent.futures import Future as WorkFuture

from nav_msgs.msg import Path
from rbprm_msgs.msg import ContactSequence, SurfaceArray
from rbprm_msgs.srv import Plan
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.exceptions import ParameterException
from rclpy.node import Node
from rclpy.task import Future
from std_msgs.msg import Header

from rbprm_core.errors import ErrorCode, InvalidInput, RbprmError
from rbprm_core.plan import ContactPlan
from rbprm_ros.conversions import (
    guide_message,
    job_of_message,
    result_message,
    sequence_message,
    statistics_message,
    update_of_message,
)
from rbprm_ros.environment import Environment
from rbprm_ros.failure import Failure, failure_of
from rbprm_ros.jobs import Job
from rbprm_ros.parameters import Parameters
from rbprm_ros.progress_log import ProgressLog
from rbprm_ros.qos import CALLS, LATCHED
from rbprm_ros.spinning import Spinner, init
from rbprm_ros.subscription import EveryPublisher
from rbprm_ros.worker import PlanningWorker

ANSWER_TIMEOUT = 0.5  # seconds that calls under way have for their answer when the node stops


class PlannerNode(Node):
    """Takes surfaces in, plans on request, publishes the plan.

    All callbacks run in one thread and none of them plans: a plan call awaits the planning process,
    which serves the calls in the order they came.

    Raises:
        InvalidInput, ParameterException: a parameter that cannot be used.
    """

    def __init__(self) -> None:
        super().__init__("rbprm_planner")
        self._declared = Parameters(self)
        self._environment = Environment()
        self._calls = 0
        robot = self._declared.settings.robot
        self._worker = PlanningWorker(robot, ProgressLog(self.get_logger(), robot))
        self._worker.prepare().add_done_callback(self._on_prepared)
        self._sequence = self.create_publisher(ContactSequence, "~/contact_sequence", LATCHED)
        self._guide = self.create_publisher(Path, "~/guide_path", LATCHED)
        EveryPublisher(self, SurfaceArray, "~/surfaces", self._on_surfaces)
        self.create_service(
            Plan,
            "~/plan",
            self._on_plan,
            qos_profile=CALLS,
            callback_group=ReentrantCallbackGroup(),  # a call waits while the next comes in
        )
        self.get_logger().info(f"up; frame {self._declared.settings.planning_frame}")

    @property
    def calls(self) -> int:
        """Plan calls not answered yet."""
        return self._calls

    def close(self) -> None:
        """Stop planning; calls under way get the code CANCELLED."""
        self._worker.close()

    def _on_prepared(self, work: WorkFuture[ContactPlan | None]) -> None:
        error = work.exception()
        if error is None:
            self.get_logger().info("the planning process is ready")
        else:
            self.get_logger().error(f"the planning process is not ready: {error}")

    def _on_surfaces(self, message: SurfaceArray) -> None:
        refused = self._environment.rejection
        settings = self._declared.settings
        try:
            update = update_of_message(message, settings)
            snapshot = self._environment.update(update, settings.max_surfaces)
        except InvalidInput as error:
            self._environment.rejection = str(error)
            if str(error) != refused:  # once, not 30 times a second
                self.get_logger().error(f"surfaces refused, the old ones stay: {error}")
            return
        self.get_logger().debug(f"surfaces {snapshot.version}: {len(snapshot.surfaces)}")

    async def _on_plan(self, message: Plan.Request, response: Plan.Response) -> Plan.Response:
        self._calls += 1
        try:
            job = job_of_message(message, self._declared.settings, self._environment)
            log = ProgressLog(self.get_logger(), f"plan {job.id[:8]}")
            plan = await self._planned(self._worker.submit(job, log))
            self._publish(job, plan, response)
        except Exception as error:
            response.result = result_message(self._failure(error))
        finally:
            self._calls -= 1
        return response

    async def _planned(self, work: WorkFuture[ContactPlan | None]) -> ContactPlan:
        """The outcome of work in the planning process; other callbacks run meanwhile."""
        done, executor = Future(), self.executor
        assert executor is not None  # it runs this callback

        def wake(_: object) -> None:
            done.set_result(None)
            executor.wake()  # a coroutine goes on when its executor looks, not by itself

        work.add_done_callback(wake)
        await done
        plan = work.result()
        assert plan is not None  # only a preparation has no plan
        return plan

    def _publish(self, job: Job, plan: ContactPlan, response: Plan.Response) -> None:
        stamp = self.get_clock().now().to_msg()
        header = Header(stamp=stamp, frame_id=self._declared.settings.planning_frame)
        assert job.snapshot is not None
        response.sequence = sequence_message(plan, header, job.id, job.snapshot.stamp)
        response.guide = guide_message(plan, header)
        response.statistics = statistics_message(plan)
        response.result = result_message()
        self._guide.publish(response.guide)
        self._sequence.publish(response.sequence)
        took = response.statistics.time_total
        self.get_logger().info(f"plan {job.id[:8]}: {len(plan.states)} states in {took:.2f} s")

    def _failure(self, error: Exception) -> Failure:
        failure = failure_of(error)
        if not isinstance(error, RbprmError):
            self.get_logger().error(traceback.format_exc())
        self.get_logger().warning(f"no plan: {ErrorCode(failure.code).name}: {failure.text}")
        return failure


def run(stop: threading.Event) -> int:
    """Serve until the event is set; returns the exit code, 2 where a parameter is wrong."""
    init()
    try:
        node = PlannerNode()
    except (InvalidInput, ParameterException) as error:
        print(f"planner_node: {error}", file=sys.stderr)
        return 2
    spinner = Spinner(node)
    spinner.spin_until(stop.is_set)
    node.close()
    spinner.spin_until(lambda: node.calls == 0, ANSWER_TIMEOUT)
    spinner.close()
    return 0
