"""Markers for RViz."""

from __future__ import annotations

import numpy as np
import pytest
from rclpy.serialization import serialize_message
from std_msgs.msg import Header
from visualization_msgs.msg import Marker, MarkerArray

from rbprm_core.plan_record import (
    ContactEntry,
    ContactPlan,
    EnvironmentEntry,
    Pose,
    RequestEntry,
    RobotEntry,
    StateEntry,
    SurfaceEntry,
)
from rbprm_core.robot import Robot, load_description
from rbprm_ros.conversions.markers import (
    MAX_LABELS,
    MAX_TRIANGLES,
    SILHOUETTES,
    markers_message,
)
from rbprm_ros.environment.snapshot import Obstacle, Snapshot
from rbprm_ros.environment.store import Environment
from rbprm_ros.environment.updates import SurfaceUpdate
from rbprm_ros.settings import Settings

HEADER = Header(frame_id="map")
UPRIGHT = (0.0, 0.0, 0.0, 1.0)
MAX_BYTES = 1_000_000


@pytest.fixture
def snapshot() -> Snapshot:
    """A square surface and a triangular obstacle."""
    square = ((0.0, 0.0, 0.0), (2.0, 0.0, 0.0), (2.0, 2.0, 0.0), (0.0, 2.0, 0.0))
    obstacle = Obstacle("o", np.array([[[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]]]))
    update = SurfaceUpdate((SurfaceEntry(id="a", vertices=square),), obstacles=(obstacle,))
    return Environment().update(update, Settings())


def walk(states: int, points: int = 1) -> ContactPlan:
    """A plan in which HyQ's left front foot moves in each state, and the right front one never."""
    description = load_description("hyq")
    robot = Robot.load(description)
    effectors = {limb.name: limb.effector for limb in robot.limbs}
    corners = ((0.1, 0.0, 0.0), (0.0, 0.1, 0.0), (-0.1, 0.0, 0.0), (0.0, -0.1, 0.0))[:points]
    joints = tuple(robot.reference[7:].tolist())
    poses = [Pose(position=(0.1 * i, 0.0, 0.6), orientation=UPRIGHT) for i in range(states)]

    def contact(limb: str, x: float) -> ContactEntry:
        return ContactEntry(
            limb=limb,
            frame=effectors[limb],
            type="point" if points == 1 else "planar",
            position=(x, 0.0, 0.0),
            orientation=UPRIGHT,
            normal=(0.0, 0.0, 1.0),
            points=tuple((x + p[0], p[1], p[2]) for p in corners),
            friction=0.5,
        )

    return ContactPlan(
        robot=RobotEntry(name="hyq", urdf=description.urdf, joint_names=robot.joint_names),
        environment=EnvironmentEntry(),
        request=RequestEntry(start=poses[0], goal=poses[-1]),
        guide=tuple(poses),
        states=tuple(
            StateEntry(
                root=pose,
                joints=joints,
                com=pose.position,
                robustness=1.0,
                contacts=(contact("lf_leg", 0.1 * i), contact("rf_leg", 0.0)),
            )
            for i, pose in enumerate(poses)
        ),
    )


def named(message: MarkerArray) -> dict[str, list[Marker]]:
    """Markers by namespace."""
    found: dict[str, list[Marker]] = {}
    for marker in message.markers:
        found.setdefault(marker.ns, []).append(marker)
    return found


def test_environment_alone(snapshot: Snapshot) -> None:
    message = markers_message(HEADER, snapshot)
    first, surfaces, obstacles = message.markers
    assert (first.action, first.ns) == (Marker.DELETEALL, "")
    assert (surfaces.ns, surfaces.type, len(surfaces.points)) == ("surfaces", 11, 6)
    assert 0 < surfaces.color.a < 1
    assert (obstacles.ns, obstacles.type, len(obstacles.points)) == ("obstacles", 11, 3)
    assert all(marker.header.frame_id == "map" for marker in message.markers)
    assert surfaces.scale.x == surfaces.scale.y == surfaces.scale.z == 1.0


def test_nothing_known_only_deletes() -> None:
    assert len(markers_message(HEADER, Snapshot()).markers) == 1


def test_point_feet(snapshot: Snapshot) -> None:
    found = named(markers_message(HEADER, snapshot, walk(4)))
    (feet,) = found["points"]
    assert len(feet.points) == len(feet.colors) == 5
    assert [p.x for p in feet.points] == pytest.approx([0.0, 0.0, 0.1, 0.2, 0.3])
    assert feet.colors[0] != feet.colors[1]  # two limbs
    assert feet.colors[0] == feet.colors[2]
    assert [marker.text for marker in found["labels"]] == ["0", "0", "1", "2", "3"]
    assert len({marker.id for marker in found["labels"]}) == 5
    (guide,) = found["guide"]
    assert [point.x for point in guide.points] == pytest.approx([0.0, 0.1, 0.2, 0.3])


def test_patches(snapshot: Snapshot) -> None:
    found = named(markers_message(HEADER, snapshot, walk(3, points=4)))
    assert "points" not in found
    (patches,) = found["patches"]
    assert len(patches.points) == len(patches.colors) == 4 * 2 * 3
    xs = [point.x for point in patches.points]
    assert (min(xs), max(xs)) == pytest.approx((-0.1, 0.3))


def test_silhouettes_stand_where_the_states_are(snapshot: Snapshot) -> None:
    robots = named(markers_message(HEADER, snapshot, walk(20)))["robot"]
    assert len(robots) == SILHOUETTES
    assert len({marker.id for marker in robots}) == SILHOUETTES
    first, last = (np.array([[p.x, p.y, p.z] for p in robots[i].points]) for i in (0, -1))
    bones = len(first) // 2
    assert bones == 12 + 2  # one line to each joint and each contact
    assert (last - first)[: 2 * 12] == pytest.approx(np.tile([1.9, 0.0, 0.0], (24, 1)))
    assert first[:, 2].max() == pytest.approx(0.6, abs=0.1)
    assert first[:, 2].min() == pytest.approx(0.0, abs=0.1)


def test_large_scenes_and_long_plans_stay_small(snapshot: Snapshot) -> None:
    rng = np.random.default_rng(0)
    many = Obstacle("many", rng.uniform(-5, 5, (3 * MAX_TRIANGLES, 3, 3)))
    environment = Environment()
    snapshot = environment.update(SurfaceUpdate(obstacles=(many,)), Settings())
    message = markers_message(HEADER, snapshot, walk(2 * MAX_LABELS))
    found = named(message)
    assert len(found["obstacles"][0].points) == 3 * MAX_TRIANGLES
    assert len(found["labels"]) == MAX_LABELS
    assert len(serialize_message(message)) < MAX_BYTES
