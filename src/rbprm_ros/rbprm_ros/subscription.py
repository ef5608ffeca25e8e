"""A subscription that hears latched and volatile publishers alike.

DDS leaves a choice of two evils: a reader that asks for transient_local gets what was latched
before it came, but does not match volatile publishers at all; a volatile reader matches both, but
what was latched before is lost on it. Hence two readers; a message that reaches both counts once.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from typing import Any

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node

from rbprm_ros.qos import LATCHED_STREAM, STREAM

REMEMBERED = 1000  # messages; far more than the two readers can be apart


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
        self._callback = callback
        self._seen: OrderedDict[tuple[int, int], None] = OrderedDict()
        group = MutuallyExclusiveCallbackGroup()  # in the order in which the messages came
        for qos in (LATCHED_STREAM, STREAM):
            node.create_subscription(
                kind,
                topic,
                self._take,  # type: ignore[arg-type]  # the stubs lack callbacks with information
                qos,
                callback_group=group,
                raw=raw,
                # A volatile publisher does not match the first reader, by intention: no warning.
                event_callbacks=SubscriptionEventCallbacks(use_default_callbacks=False),
            )

    def _take(self, message: Any, info: dict[str, Any]) -> None:
        key = (info["source_timestamp"], info["publication_sequence_number"])
        if key in self._seen:
            return
        self._seen[key] = None
        if len(self._seen) > REMEMBERED:
            self._seen.popitem(last=False)
        self._callback(message)
