"""A subscription to latched and volatile publishers alike, in the order of their messages.

DDS offers two subscriptions, each of which misses something: a transient_local one gets what was
latched before it existed, but does not match volatile publishers; a volatile one matches both, but
misses what was latched. Hence this subscription has two readers, and a message that reaches both
counts once.

Latched messages may arrive later than new messages at the other reader. So both readers are emptied
together, and the messages are sorted by the time at which they were sent. After a publisher has
been discovered, messages that have arrived at the volatile reader alone wait for a moment: if the
publisher is latched, they arrive at the other reader too, in their order.
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

MAX_SEEN = 1000  # messages that are recognised when they come twice; far more than are in flight
SETTLING_TIME = 0.1  # seconds for the latched messages of a new publisher to arrive

Key = tuple[int, int]  # time at which a message was sent, nanoseconds, and its sequence number


class EveryPublisher:
    """Calls back once for each message of any reliable publisher of a topic.

    Args:
        node: node that subscribes.
        kind: class of the messages.
        topic: name of the topic.
        callback: called with each message; must not raise.
        raw: call back with the serialised message (CDR) instead.
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
        self._waiting: dict[Key, Any] = {}  # messages without a callback so far
        self._ordered: set[Key] = set()  # those of them that arrived at the latched reader
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
                # Volatile publishers do not match the first reader, by design: no warning.
                event_callbacks=SubscriptionEventCallbacks(
                    matched=lambda _: self._count_publishers(), use_default_callbacks=False
                ),
            )
            for qos, take in ((LATCHED_STREAM, self._take_latched), (STREAM, self._take_volatile))
        )
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._settling = node.create_timer(SETTLING_TIME, self._end_settling, group, steady)
        self._settling.cancel()
        self._settled: Future | None = None  # done at the end of the settling time

    async def settled(self) -> None:
        """Wait until there was a callback for every message that has arrived so far."""
        self._deliver()
        while not self._settling.is_canceled():
            self._settled = self._settled or Future()
            await self._settled

    def _end_settling(self) -> None:
        self._settling.cancel()
        self._deliver()
        if self._settled is not None and self._settling.is_canceled():
            self._settled.set_result(None)
            self._settled = None
            if self._node.executor is not None:
                self._node.executor.wake()

    def _take_latched(self, message: Any, info: dict[str, Any]) -> None:
        self._keep(message, info, latched=True)
        self._deliver()

    def _take_volatile(self, message: Any, info: dict[str, Any]) -> None:
        self._keep(message, info, latched=False)
        self._deliver()

    def _count_publishers(self) -> None:
        publishers = self._node.count_publishers(self._volatile.topic_name)
        if publishers > self._publishers:
            self._settling.reset()
        self._publishers = publishers

    def _deliver(self) -> None:
        """Empty both readers, and call back for the messages that are due, in their order."""
        for reader in (self._latched, self._volatile):
            with reader.handle:
                while taken := reader.handle.take_message(reader.msg_type, reader.raw):
                    message, info = taken
                    self._keep(message, info, latched=reader is self._latched)
        self._count_publishers()  # the event may come after a publisher's first message
        due = self._waiting if self._settling.is_canceled() else self._ordered
        messages = [self._waiting.pop(key) for key in sorted(due)]
        self._ordered.clear()
        for message in messages:
            self._callback(message)

    def _keep(self, message: Any, info: dict[str, Any], latched: bool) -> None:
        """Keep a message for its callback, unless it has arrived before."""
        key = (info["source_timestamp"], info["publication_sequence_number"])
        if key not in self._seen:
            self._seen[key] = None
            self._waiting[key] = message
            if len(self._seen) > MAX_SEEN:
                self._seen.popitem(last=False)
        if latched and key in self._waiting:
            self._ordered.add(key)
