"""A subscription that hears latched and volatile publishers alike, in the order of their messages.

DDS leaves a choice of two evils: a reader that asks for transient_local gets what was latched
before it came, but does not match volatile publishers at all; a volatile reader matches both, but
what was latched before is lost on it. Hence two readers; a message that reaches both counts once.

What was latched takes its time, while new messages already come to the other reader. So both are
emptied together and the messages sorted by when they were sent; and where a publisher has just
been found, what has come to the volatile reader alone waits for a moment: if the publisher is a
latched one, it comes to the other reader too, in its turn.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from typing import Any

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.task import Future

from rbprm_ros.rclpy_utils.qos import LATCHED_STREAM, STREAM

REMEMBERED = 1000  # messages; far more than the two readers can be apart
SETTLING = 0.1  # seconds that a new publisher has for what it has latched

Key = tuple[int, int]  # when a message was sent, nanoseconds, and its number with its publisher


class EveryPublisher:
    """Calls back once for each message of any reliable publisher of a topic.

    Args:
        callback: given the message; must not raise.
        raw: give it the message's bytes on the wire (CDR) instead.
    """

    def __init__(
        self,
        node: Node,
        kind: type,
        topic: str,
        callback: Callable[[Any], None],
        *,
        raw: bool = False,
    ) -> None:
        self._node, self._callback = node, callback
        self._seen: OrderedDict[Key, None] = OrderedDict()
        self._waiting: dict[Key, Any] = {}  # messages not handed on yet
        self._in_turn: set[Key] = set()  # those of them that came to the latched reader
        self._publishers = 0
        group = MutuallyExclusiveCallbackGroup()
        self._latched, self._volatile = (
            node.create_subscription(
                kind,
                topic,
                take,  # type: ignore[arg-type]  # the stubs lack callbacks with information
                qos,
                callback_group=group,
                raw=raw,
                # A volatile publisher does not match the first reader, by intention: no warning.
                event_callbacks=SubscriptionEventCallbacks(
                    matched=lambda _: self._look_for_publishers(), use_default_callbacks=False
                ),
            )
            for qos, take in ((LATCHED_STREAM, self._take_latched), (STREAM, self._take_volatile))
        )
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._settling = node.create_timer(SETTLING, self._end_settling, group, steady)
        self._settling.cancel()
        self._settled: Future | None = None  # awaited by those who want all that has come

    async def settled(self) -> None:
        """Call back for all that has come, and wait until that is done."""
        self._hand_on()
        while not self._settling.is_canceled():
            self._settled = self._settled or Future()
            await self._settled

    def _end_settling(self) -> None:
        self._settling.cancel()
        self._hand_on()
        if self._settled is not None and self._settling.is_canceled():
            self._settled.set_result(None)
            self._settled = None
            if self._node.executor is not None:
                self._node.executor.wake()

    def _take_latched(self, message: Any, info: dict[str, Any]) -> None:
        self._keep(message, info, in_turn=True)
        self._hand_on()

    def _take_volatile(self, message: Any, info: dict[str, Any]) -> None:
        self._keep(message, info, in_turn=False)
        self._hand_on()

    def _look_for_publishers(self) -> None:
        publishers = self._node.count_publishers(self._volatile.topic_name)
        if publishers > self._publishers:
            self._settling.reset()
        self._publishers = publishers

    def _hand_on(self) -> None:
        """Empty both readers, and call back for what is due, in the order in which it was sent."""
        for reader in (self._latched, self._volatile):
            with reader.handle:
                while taken := reader.handle.take_message(reader.msg_type, reader.raw):
                    message, info = taken
                    self._keep(message, info, in_turn=reader is self._latched)
        self._look_for_publishers()  # the event may come after the first message
        due = self._waiting if self._settling.is_canceled() else self._in_turn
        messages = [self._waiting.pop(key) for key in sorted(due)]
        self._in_turn.clear()
        for message in messages:
            self._callback(message)

    def _keep(self, message: Any, info: dict[str, Any], in_turn: bool) -> None:
        """Keep a message to be handed on, if it did not come before."""
        key = (info["source_timestamp"], info["publication_sequence_number"])
        if key not in self._seen:
            self._seen[key] = None
            self._waiting[key] = message
            if len(self._seen) > REMEMBERED:
                self._seen.popitem(last=False)
        if in_turn and key in self._waiting:
            self._in_turn.add(key)
