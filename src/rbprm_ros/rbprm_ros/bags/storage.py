"""Bags of the messages between planner and executive, in sqlite3 or MCAP, without rosbag2.

A bag holds the definitions of its messages, so that reading it needs neither ROS nor rbprm_msgs.
Messages are written and read as they are on the wire (CDR).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Literal

from ament_index_python import get_package_share_directory
from nav_msgs.msg import Path as PathMessage
from rbprm_msgs.msg import ContactSequence, ExecutionState, PlannerStatus, SurfaceArray
from rclpy.qos import QoSProfile
from rosbags.interfaces import (
    Connection,
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import Reader, ReaderError, StoragePlugin, Writer, WriterError
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore
from visualization_msgs.msg import MarkerArray

from rbprm_core.errors import InvalidInput
from rbprm_ros.rclpy_utils.qos import LATCHED, LATCHED_STREAM, STREAM

VERSION: Literal[9] = 9  # of the bag format: that of Jazzy's rosbag2
UNLIMITED = QosTime(0x7FFFFFFF, 0xFFFFFFFF)


@dataclass(frozen=True)
class Topic:
    """A topic of the planner.

    Attributes:
        kind: class of its messages.
        qos: quality of service with which it is played.
    """

    kind: type[Any]
    qos: QoSProfile


TOPICS: Mapping[str, Topic] = {
    "contact_sequence": Topic(ContactSequence, LATCHED),
    "guide_path": Topic(PathMessage, LATCHED),
    "status": Topic(PlannerStatus, LATCHED),
    # A planner that starts later needs the snapshot and the changes after it, on both topics.
    "surfaces": Topic(SurfaceArray, LATCHED_STREAM),
    "surface_markers": Topic(MarkerArray, LATCHED_STREAM),
    "execution_state": Topic(ExecutionState, STREAM),
}
"""The recorded topics, by their names below that of the planner."""


@dataclass(frozen=True)
class BagMessage:
    """A message of a bag.

    Attributes:
        topic: key of `TOPICS`.
        stamp: time of the recording, nanoseconds.
        data: the serialised message (CDR).
    """

    topic: str
    stamp: int
    data: bytes


class BagWriter:
    """A new bag.

    Args:
        folder: folder of the bag; must not exist.
        node: full name of the planner whose topics are recorded.
        storage: "mcap" or "sqlite3".

    Attributes:
        count: number of messages written.

    Raises:
        InvalidInput: `folder` or `storage` cannot be used.
    """

    def __init__(self, folder: Path, node: str, storage: str) -> None:
        plugins = {plugin.name.lower(): plugin for plugin in StoragePlugin}
        if storage not in plugins:
            raise InvalidInput("storage", storage, f"must be one of {', '.join(plugins)}")
        try:
            self._writer = Writer(folder, version=VERSION, storage_plugin=plugins[storage])
            self._writer.open()
        except (WriterError, OSError) as error:
            reason = f"no bag can be made there ({error}); name a new folder"
            raise InvalidInput("folder", str(folder), reason) from error
        self._node, self._typestore = node, typestore()
        self._connections: dict[str, Connection] = {}
        self.count = 0

    def write(self, message: BagMessage) -> None:
        """Append a message.

        Args:
            message: the message.
        """
        connection = self._connections.get(message.topic)
        if connection is None:
            connection = self._connections[message.topic] = self._connect(message.topic)
        self._writer.write(connection, message.stamp, message.data)
        self.count += 1

    def close(self) -> None:
        """Complete the bag; it cannot be read before."""
        self._writer.close()

    def __enter__(self) -> BagWriter:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def _connect(self, name: str) -> Connection:
        topic = TOPICS[name]
        return self._writer.add_connection(
            f"{self._node}/{name}",
            type_name(topic.kind),
            typestore=self._typestore,
            offered_qos_profiles=[_bag_qos(topic.qos)],
        )


def read_bag(folder: Path) -> Iterator[BagMessage]:
    """The messages of a bag on topics of a planner, in the order of the recording.

    Args:
        folder: folder of the bag.

    Raises:
        InvalidInput: `folder` is no bag, or is not complete.
    """
    try:
        with Reader(folder) as reader:
            for connection, stamp, data in reader.messages():
                name = connection.topic.rpartition("/")[2]
                if name in TOPICS and connection.msgtype == type_name(TOPICS[name].kind):
                    yield BagMessage(name, stamp, bytes(data))
    except (ReaderError, OSError) as error:
        reason = f"cannot be read as a bag ({error})"
        raise InvalidInput("folder", str(folder), reason) from error


def typestore() -> Typestore:
    """The message definitions of ROS 2 Jazzy and, from its .msg files, of rbprm_msgs."""
    store = get_typestore(Stores.ROS2_JAZZY)
    files = Path(get_package_share_directory("rbprm_msgs")).glob("msg/*.msg")
    found: dict[str, Any] = {}
    for file in files:
        found |= get_types_from_msg(file.read_text(), f"rbprm_msgs/msg/{file.stem}")
    store.register(found)
    return store


def type_name(kind: type[Any]) -> str:
    """The name of a message class in bags.

    Args:
        kind: class of the messages.
    """
    return f"{kind.__module__.partition('.')[0]}/msg/{kind.__name__}"


def _bag_qos(qos: QoSProfile) -> Qos:
    latched = qos.durability == LATCHED.durability
    return Qos(
        QosHistory.KEEP_LAST,
        qos.depth,
        QosReliability.RELIABLE,
        QosDurability.TRANSIENT_LOCAL if latched else QosDurability.VOLATILE,
        UNLIMITED,
        UNLIMITED,
        QosLiveliness.AUTOMATIC,
        UNLIMITED,
        False,
    )
