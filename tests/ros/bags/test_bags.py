"""Bags: recorded from a running planner, read with and without ROS, and played."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from ament_index_python import get_package_share_directory
from geometry_msgs.msg import Point
from rbprm_msgs.msg import SurfaceArray
from rbprm_msgs.srv import Plan
from rclpy.serialization import deserialize_message, serialize_message
from rosbags.rosbag2 import Reader
from visualization_msgs.msg import Marker, MarkerArray

from rbprm_core.errors import InvalidInput
from rbprm_ros.bags.storage import TOPICS, BagMessage, BagWriter, read_bag, type_name, typestore
from rbprm_ros.rclpy_utils.qos import LATCHED

if TYPE_CHECKING:
    from conftest import Executive, Site

ROOT = Path(__file__).parents[3]
WITHOUT_ROS = ROOT / ".venv" / "peer" / "bin" / "python"  # made by `make test`
ARGUMENTS = ("--ros-args", "-p")


def heard(executive: Executive, name: str, node: str = "/rbprm_planner") -> list[Any]:
    """Collect the messages on a topic of the planner from now on."""
    kept: list[Any] = []
    topic = TOPICS[name]
    executive.node.create_subscription(topic.kind, f"{node}/{name}", kept.append, topic.qos)
    return kept


def recorded(bag: Path, name: str) -> list[Any]:
    """The messages of a topic in a bag."""
    data = [message.data for message in read_bag(bag) if message.topic == name]
    return [deserialize_message(item, TOPICS[name].kind) for item in data]


def roots(guide: Any) -> list[Any]:
    """The root poses of a guide, without stamps, which may differ from message to message."""
    return [stamped.pose for stamped in guide.poses]


def without_ros(bag: Path) -> list[dict[str, Any]]:
    """The output of the example that reads a bag, in an environment without ROS."""
    command = [WITHOUT_ROS, "-I", ROOT / "examples" / "read_bag.py", bag, "--json"]
    done = subprocess.run(command, env={}, capture_output=True, text=True, timeout=60, check=True)
    return [json.loads(line) for line in done.stdout.splitlines()]


def test_recorded_from_the_planner_read_back_and_replayed(
    shared: Site,
    executive: Executive,
    ground: SurfaceArray,
    request_on_ground: Plan.Request,
    plain: Callable[[Any], Any],
    tmp_path: Path,
) -> None:
    bags = [tmp_path / storage for storage in ("mcap", "sqlite3")]
    recorders = [
        shared.start("record_bag", str(bag), *ARGUMENTS, f"storage:={bag.name}") for bag in bags
    ]
    executive.listen()
    executive.publish(ground)
    for recorder in recorders:
        recorder.wait_for("first message of surfaces")
    response = executive.call_on_surfaces(request_on_ground)
    assert response.result.code == response.result.SUCCESS, response.result.text
    identity = response.sequence.sequence_id
    executive.spin_until(
        lambda: (
            any(sequence.sequence_id == identity for sequence in executive.sequences[-1:])
            and any(roots(guide) == roots(response.guide) for guide in executive.guides[-1:])
        ),
        "sequence and guide on their topics",
    )
    sequence, guide = executive.sequences[-1], executive.guides[-1]
    assert sequence.states == response.sequence.states
    for recorder in recorders:
        recorder.wait_for("first message of contact_sequence")
        recorder.wait_for("first message of guide_path")
        assert recorder.stop() == 0

    for bag in bags:
        assert list(bag.glob("*.mcap" if bag.name == "mcap" else "*.db3"))
        assert recorded(bag, "surfaces") == [ground]
        assert recorded(bag, "contact_sequence")[-1] == sequence
        assert recorded(bag, "guide_path")[-1] == guide
        read = [line for line in without_ros(bag) if line["topic"].endswith("/contact_sequence")]
        assert read[-1]["message"] == plain(sequence)
        assert_replayed(bag, shared, executive)


def assert_replayed(bag: Path, site: Site, executive: Executive) -> None:
    """The bag is played under another planner's name, apart from the running planner's messages."""
    node = f"/replayed_{bag.name}"
    again = {name: heard(executive, name, node) for name in ("surfaces", "guide_path")}
    player = site.start("play_bag", str(bag), *ARGUMENTS, f"planner:={node}", "-p", "rate:=100.0")
    player.wait_for("all played")
    for name, messages in again.items():
        newest = recorded(bag, name)[-1]
        executive.spin_until(lambda m=messages, n=newest: n in m, f"{name} again")  # type: ignore[misc]
    assert again["surfaces"] == recorded(bag, "surfaces")
    late = heard(executive, "contact_sequence", node)
    executive.spin_until(lambda: bool(late), "the latched sequence")
    assert late == recorded(bag, "contact_sequence")[-1:]
    assert player.stop() == 0


def test_surfaces_alone_are_replayed_to_a_planner_that_plans_on_them(
    shared: Site,
    executive: Executive,
    ground: SurfaceArray,
    request_on_ground: Plan.Request,
    tmp_path: Path,
) -> None:
    """Another robot's bag, with a change in it, is played under the running planner's name."""
    ground.surfaces[0].id = "replayed"
    with BagWriter(tmp_path / "bag", "/another", "mcap") as writer:
        writer.write(BagMessage("surfaces", 1_000, serialize_message(ground)))
        writer.write(BagMessage("surfaces", 2_000, serialize_message(SurfaceArray(is_diff=True))))
        writer.write(BagMessage("status", 3_000, serialize_message(TOPICS["status"].kind())))
    player = shared.start("play_bag", str(tmp_path / "bag"), *ARGUMENTS, "topics:=[surfaces]")
    player.wait_for("2 messages to /rbprm_planner")

    def surfaces_planned_on() -> set[str]:
        response = executive.call_on_surfaces(request_on_ground)
        return {c.surface_id for state in response.sequence.states for c in state.contacts}

    executive.spin_until(lambda: surfaces_planned_on() == {"replayed"}, "replayed surfaces")
    assert player.stop() == 0


def test_surfaces_in_markers_are_recorded_too(site: Site, tmp_path: Path) -> None:
    executive = site.executive()
    bag, node = tmp_path / "bag", "/another"
    recorder = site.start("record_bag", str(bag), *ARGUMENTS, f"planner:={node}")
    marker = Marker(ns="stairs", id=3, type=Marker.TRIANGLE_LIST)
    marker.points = [Point(x=0.0, y=0.0), Point(x=1.0, y=0.0), Point(x=0.0, y=1.0)]
    sent = MarkerArray(markers=[marker])
    executive.node.create_publisher(MarkerArray, f"{node}/surface_markers", LATCHED).publish(sent)
    recorder.wait_for("first message of surface_markers")
    assert recorder.stop() == 0
    assert recorded(bag, "surface_markers") == [sent]


def test_types_of_a_bag_are_those_of_the_interfaces(tmp_path: Path) -> None:
    """Bags of rbprm and of `ros2 bag` have the same message definitions."""
    with BagWriter(tmp_path / "bag", "/planner", "mcap") as writer:
        for stamp, name in enumerate(TOPICS):
            writer.write(BagMessage(name, stamp, b""))
    with Reader(tmp_path / "bag") as reader:
        kinds = {connection.topic: connection for connection in reader.connections}
    for name, topic in TOPICS.items():
        connection = kinds[f"/planner/{name}"]
        assert connection.msgtype == type_name(topic.kind)
        package, _, kind = connection.msgtype.split("/")
        described = Path(get_package_share_directory(package)) / "msg" / f"{kind}.json"
        hashes = json.loads(described.read_text())["type_hashes"]
        expected = {item["type_name"]: item["hash_string"] for item in hashes}
        assert typestore().hash_rihs01(connection.msgtype) == expected[connection.msgtype]
        assert connection.digest == expected[connection.msgtype]


@pytest.mark.parametrize(
    ("name", "arguments", "field"),
    [
        ("record_bag", ("{there}",), "folder"),
        ("record_bag", ("{new}", *ARGUMENTS, "storage:=paper"), "storage"),
        ("play_bag", ("{there}",), "folder"),
        ("play_bag", ("{there}", *ARGUMENTS, "topics:=[tf]"), "topics"),
        ("play_bag", ("{there}", *ARGUMENTS, "rate:=0.0"), "rate"),
    ],
)
def test_arguments_that_cannot_be_used_are_named(
    name: str, arguments: tuple[str, ...], field: str, site: Site, tmp_path: Path
) -> None:
    folders = {"there": tmp_path, "new": tmp_path / "new"}
    process = site.start(name, *(argument.format(**folders) for argument in arguments))
    assert process.popen.wait(60.0) == 2
    assert field in process.log.read_text()


def test_a_bag_cut_short_is_refused(tmp_path: Path) -> None:
    writer = BagWriter(tmp_path / "bag", "/planner", "sqlite3")
    with pytest.raises(InvalidInput, match="cannot be read as a bag"):
        list(read_bag(tmp_path / "bag"))
    writer.close()
    assert list(read_bag(tmp_path / "bag")) == []
