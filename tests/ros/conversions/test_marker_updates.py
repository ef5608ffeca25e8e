"""Triangle lists in marker arrays, from messages to the environment, without a node."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from geometry_msgs.msg import Point, Pose, Quaternion, Vector3
from rclpy.serialization import deserialize_message, serialize_message
from std_msgs.msg import Header
from visualization_msgs.msg import Marker, MarkerArray

from rbprm_core.errors import InvalidInput
from rbprm_core.scene import Classification, surfaces_from_mesh
from rbprm_core.surface_kind import SurfaceKind
from rbprm_ros.conversions.marker_updates import update_of_markers
from rbprm_ros.environment.store import Environment
from rbprm_ros.settings import Settings, parse_settings

BOX = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
FACES = (
    (0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1),
    (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3),
)  # fmt: skip
TRIANGLES = BOX[np.array(FACES)]
FAR = [Point(), Point(x=9e4), Point(y=1.0)]


def box(identity: int = 0, namespace: str = "seen", **changes: Any) -> Marker:
    """A unit box as a triangle list."""
    points = [Point(x=x, y=y, z=z) for x, y, z in TRIANGLES.reshape(-1, 3).tolist()]
    fields = {"scale": Vector3(x=1.0, y=1.0, z=1.0), "points": points, **changes}
    return Marker(ns=namespace, id=identity, type=Marker.TRIANGLE_LIST, **fields)


def sent(environment: Environment, markers: Sequence[Marker]) -> Environment:
    """The environment after a serialised message."""
    message = deserialize_message(serialize_message(MarkerArray(markers=markers)), MarkerArray)
    environment.update(update_of_markers(message, Settings()), Settings())
    return environment


@pytest.fixture
def environment() -> Environment:
    """Two boxes in two namespaces."""
    return sent(Environment(), [box(0, "a"), box(0, "b")])


def roots(environment: Environment) -> set[str]:
    """Markers of which surfaces remain."""
    return {surface.id.rpartition("/")[0] for surface in environment.snapshot.surfaces}


def test_facets_are_those_of_a_mesh() -> None:
    snapshot = sent(Environment(), [box()]).snapshot
    facets = surfaces_from_mesh(TRIANGLES, Settings().marker_friction, Classification())
    contacts = [f for f in facets if f.kind is not SurfaceKind.OTHER]
    assert [s.id for s in snapshot.surfaces] == [f"seen/0/{f.id}" for f in contacts]
    assert [s.kind for s in snapshot.surfaces] == [f.kind for f in contacts]
    assert len(contacts) == 5  # the top and four walls
    (bottom,) = snapshot.obstacles
    assert bottom.id == "seen/0"
    assert bottom.triangles.shape == (2, 3, 3)
    assert not bottom.triangles[..., 2].any()
    everything = snapshot.scene().triangles
    assert everything.max(axis=(0, 1)) == pytest.approx(1.0)
    assert len(everything) == len(TRIANGLES)


def test_pose_and_scale() -> None:
    turned = Quaternion(z=math.sin(math.pi / 4), w=math.cos(math.pi / 4))
    pose = Pose(position=Point(x=5.0, y=0.0, z=1.0), orientation=turned)
    snapshot = sent(Environment(), [box(pose=pose, scale=Vector3(x=2.0, y=1.0, z=0.5))]).snapshot
    corners = snapshot.scene().triangles.reshape(-1, 3)
    assert corners.min(axis=0) == pytest.approx([4.0, 0.0, 1.0])
    assert corners.max(axis=0) == pytest.approx([5.0, 2.0, 1.5])


def test_orientation_that_nobody_set_is_the_identity() -> None:
    pose = Pose(position=Point(x=1.0), orientation=Quaternion(w=0.0))
    corners = sent(Environment(), [box(pose=pose)]).snapshot.scene().triangles
    assert corners.max(axis=(0, 1)) == pytest.approx([2.0, 1.0, 1.0])


def test_repeats_change_nothing(environment: Environment) -> None:
    before = environment.snapshot
    after = sent(environment, [box(0, "b"), box(0, "a")]).snapshot
    assert after.version == before.version
    assert all(x is y for x, y in zip(after.surfaces, before.surfaces, strict=True))


def test_modify_replaces_what_the_marker_was(environment: Environment) -> None:
    pose = Pose(position=Point(x=3.0))
    snapshot = sent(environment, [box(0, "a", pose=pose)]).snapshot
    assert len(snapshot.surfaces) == 10
    moved = [s for s in snapshot.surfaces if s.id.startswith("a/")]
    assert min(s.polygon.boundary[:, 0].min() for s in moved) == pytest.approx(3.0)
    assert [o.id for o in snapshot.obstacles] == ["a/0", "b/0"]


def test_delete(environment: Environment) -> None:
    sent(environment, [Marker(ns="a", id=0, action=Marker.DELETE)])
    assert roots(environment) == {"b/0"}
    version = environment.version
    sent(environment, [Marker(ns="a", id=0, action=Marker.DELETE)])  # it is not there any more
    assert environment.version == version


@pytest.mark.parametrize(
    ("namespace", "left"), [("", set()), ("a", {"b/0"}), ("c", {"a/0", "b/0"})]
)
def test_delete_all(environment: Environment, namespace: str, left: set[str]) -> None:
    sent(environment, [Marker(ns=namespace, action=Marker.DELETEALL)])
    assert roots(environment) == left


def test_actions_count_in_their_order(environment: Environment) -> None:
    delete_all = Marker(action=Marker.DELETEALL)
    sent(environment, [box(1, "a"), delete_all, box(2, "b"), box(3, "b")])
    assert roots(environment) == {"b/2", "b/3"}
    sent(environment, [box(4, "b"), Marker(ns="b", id=4, action=Marker.DELETE)])
    assert roots(environment) == {"b/2", "b/3"}


@pytest.mark.parametrize(
    ("marker", "field"),
    [
        (Marker(type=Marker.CUBE), "type"),
        (box(action=1), "action"),
        (box(header=Header(frame_id="odom")), "header.frame_id"),
        (box(scale=Vector3()), "scale"),
        (box(scale=Vector3(x=1.0, y=-1.0, z=1.0)), "scale"),
        (box(scale=Vector3(x=1.0, y=math.nan, z=1.0)), "scale"),
        (box(pose=Pose(orientation=Quaternion(w=0.5))), "pose.orientation"),
        (box(pose=Pose(position=Point(z=math.inf))), "pose.position"),
        (box(points=[]), "points"),
        (box(points=[Point()] * 4), "points"),
        (box(points=[Point()] * 3), "points"),
        (box(points=[Point(), Point(x=1.0), Point(y=math.nan)]), "points.2"),
        (box(points=FAR, scale=Vector3(x=2.0, y=1.0, z=1.0)), "points"),
    ],
)  # fmt: skip
def test_refused(marker: Marker, field: str) -> None:
    with pytest.raises(InvalidInput) as caught:
        update_of_markers(MarkerArray(markers=[box(), marker]), Settings())
    assert caught.value.field == f"markers.1.{field}"


def test_limits() -> None:
    message = MarkerArray(markers=[box(0), box(1)])
    for name, value in (("max_obstacles", 1), ("max_triangles", 23)):
        with pytest.raises(InvalidInput, match=name) as caught:
            update_of_markers(message, parse_settings({name: value}))
        assert caught.value.field == "markers"
