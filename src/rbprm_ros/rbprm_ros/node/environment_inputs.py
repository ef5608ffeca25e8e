"""The node's environment and the topics that change it."""

from __future__ import annotations

from collections.abc import Callable

from rbprm_msgs.msg import SurfaceArray
from rclpy.executors import Executor
from rclpy.node import Node
from rclpy.task import Future
from visualization_msgs.msg import MarkerArray

from rbprm_core.errors import Cancelled, InvalidInput
from rbprm_ros.conversions import update_of_markers, update_of_message
from rbprm_ros.environment.store import Environment
from rbprm_ros.environment.update_queue import UpdateQueue
from rbprm_ros.environment.updates import SurfaceUpdate
from rbprm_ros.rclpy_utils.subscription import EveryPublisher
from rbprm_ros.settings import Settings


class EnvironmentInputs:
    """Updates the environment from ~/surfaces and ~/surface_markers.

    Args:
        node: the planner's node.
        settings: returns the current parameters.
        executor: returns the executor that runs the callbacks.
        on_change: called after an update that changed something.

    Attributes:
        environment: the environment.
    """

    def __init__(
        self,
        node: Node,
        settings: Callable[[], Settings],
        executor: Callable[[], Executor],
        on_change: Callable[[], None],
    ) -> None:
        self.environment = Environment()
        self._settings, self._logger = settings, node.get_logger()
        self._updates = UpdateQueue(self.environment, settings, executor, on_change)
        self._subscriptions = (
            EveryPublisher(node, SurfaceArray, "~/surfaces", self._on_surfaces),
            EveryPublisher(node, MarkerArray, "~/surface_markers", self._on_markers),
        )

    def add(self, update: SurfaceUpdate) -> Future:
        """Add an update behind those that wait; see `UpdateQueue.add`.

        Args:
            update: the update.
        """
        return self._updates.add(update)

    async def settled(self) -> None:
        """Wait until everything published so far is accepted or refused."""
        for subscription in self._subscriptions:
            await subscription.settled()
        await self._updates.settled()

    def clear(self) -> None:
        """Remove everything from the environment."""
        self._updates.clear()

    def _on_surfaces(self, message: SurfaceArray) -> None:
        self._accept(lambda settings: update_of_message(message, settings), "surfaces")

    def _on_markers(self, message: MarkerArray) -> None:
        self._accept(lambda settings: update_of_markers(message, settings), "surface markers")

    def _accept(self, read: Callable[[Settings], SurfaceUpdate], what: str) -> None:
        """Add the update of a message; an invalid message changes nothing.

        Args:
            read: converts the message.
            what: name of the messages, for the log.
        """
        rejection = self.environment.rejection

        def refuse(error: Exception | None) -> None:
            if error is None or isinstance(error, Cancelled):
                return
            self.environment.rejection = str(error)
            if str(error) != rejection:  # once, not 30 times a second
                self._logger.error(f"{what} refused, the old ones stay: {error}")

        try:
            update = read(self._settings())
        except InvalidInput as error:
            refuse(error)
        else:
            self.add(update).add_done_callback(lambda done: refuse(done.exception()))
