"""A goal of the planner's action, as its client sees it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rbprm_msgs.action import PlanContacts
from rclpy.action.client import ClientGoalHandle
from rclpy.task import Future

from rbprm_ros.client.timing import ANSWER_TIMEOUT

if TYPE_CHECKING:
    from rbprm_ros.client.planner_client import PlannerClient


class PlanCall:
    """A goal of the action, made by `PlannerClient.plan`.

    Args:
        client: the client that sends the goal.

    Attributes:
        feedback: the newest feedback; None before the first.
    """

    def __init__(self, client: PlannerClient) -> None:
        self.feedback: PlanContacts.Feedback | None = None
        self._client = client
        self._handle: ClientGoalHandle | None = None
        self._answer: PlanContacts.Result | None = None
        self._error: Exception | None = None

    @property
    def done(self) -> bool:
        """Whether the goal has ended."""
        return self._answer is not None or self._error is not None

    def result(self, timeout: float) -> PlanContacts.Result:
        """Wait for the result and return it; its `result.code` tells whether there is a plan.

        Args:
            timeout: longest time to wait, seconds; longer than the goal's own time limit.

        Raises:
            PlannerTimeout: the goal has not ended; wait again, or cancel it.
            RuntimeError: the node refused the goal, or the call failed.
        """
        self._client.wait_until(lambda: self.done, "result of the goal", timeout)
        if self._error is not None:
            raise RuntimeError(f"the goal has no result: {self._error}") from self._error
        return self._answer

    def cancel(self, timeout: float = ANSWER_TIMEOUT) -> bool:
        """Cancel the goal, whose result then has the code CANCELLED.

        Args:
            timeout: longest time to wait for the planner's answer, seconds.

        Returns:
            Whether the goal is being cancelled; False where it had ended.

        Raises:
            PlannerTimeout: the planner did not answer.
        """
        client = self._client
        client.wait_until(lambda: self._handle is not None or self.done, "accepted goal", timeout)
        handle = self._handle
        if handle is None or self.done:
            return False
        request = client.in_executor(handle.cancel_goal_async)
        return bool(client.answer(request, "answer to the cancellation", timeout).goals_canceling)

    def on_feedback(self, message: Any) -> None:
        """Keep the newest feedback; called in the executor's thread.

        Args:
            message: feedback of the action.
        """
        self.feedback = message.feedback

    def on_response(self, future: Future) -> None:
        """The planner accepted or refused the goal; called in the executor's thread.

        Args:
            future: future of the planner's response.
        """
        handle = future.result()
        if not handle.accepted:
            self._error = RuntimeError("the planner refused it; is it shutting down?")
        else:
            self._handle = handle
            handle.get_result_async().add_done_callback(self._on_result)
        self._client.wake()

    def _on_result(self, future: Future) -> None:
        self._error = future.exception()
        if self._error is None:
            self._answer = future.result().result
        self._client.wake()
