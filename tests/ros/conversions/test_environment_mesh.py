"""Environments from mesh files, and the whole environment as a message."""

from __future__ import annotations

import importlib.util
import math
import re
from pathlib import Path

import numpy as np
import pytest
import trimesh
from geometry_msgs.msg import Point, Pose, Quaternion
from rbprm_msgs.msg import SurfaceArray
from rbprm_msgs.srv import SetEnvironment
from rclpy.serialization import deserialize_message, serialize_message
from std_msgs.msg import Header

from rbprm_core.errors import InvalidInput
from rbprm_core.resources import PATH_VARIABLE
from rbprm_core.surface_kind import SurfaceKind
from rbprm_ros.conversions.environments import snapshot_update, update_of_setting
from rbprm_ros.conversions.surfaces import environment_message, update_of_message
from rbprm_ros.environment.snapshot import Snapshot
from rbprm_ros.environment.store import Environment
from rbprm_ros.settings import Settings, parse_settings

SETTINGS = Settings()


@pytest.fixture
def block(tmp_path: Path) -> str:
    """Mesh file of a box about the origin: 2 m by 1 m, 0.2 m high."""
    file = tmp_path / "block.stl"
    trimesh.creation.box((2.0, 1.0, 0.2)).export(file)
    return str(file)


def taken_in(mesh: str, pose: Pose, settings: Settings = SETTINGS) -> Snapshot:
    return Environment().update(snapshot_update(mesh, pose, 0.7, settings), settings)


def kinds(snapshot: Snapshot) -> list[SurfaceKind]:
    return [surface.kind for surface in snapshot.surfaces]


def test_contact_surfaces_and_the_rest(block: str) -> None:
    snapshot = taken_in(block, Pose())
    assert kinds(snapshot) == [SurfaceKind.LEAN] * 4 + [SurfaceKind.SUPPORT]
    assert all(s.id.startswith("block/") and s.friction == 0.7 for s in snapshot.surfaces)
    assert [len(obstacle.triangles) for obstacle in snapshot.obstacles] == [2]  # the bottom
    triangles = snapshot.scene().triangles
    assert triangles.min(axis=(0, 1)) == pytest.approx([-1.0, -0.5, -0.1])


def test_pose(block: str) -> None:
    turned = Quaternion(z=math.sin(math.pi / 4), w=math.cos(math.pi / 4))
    snapshot = taken_in(block, Pose(position=Point(x=4.0), orientation=turned))
    assert snapshot.scene().triangles.max(axis=(0, 1)) == pytest.approx([4.5, 1.0, 0.1])
    nobody_set = Pose(orientation=Quaternion(w=0.0))
    assert taken_in(block, nobody_set).scene().triangles.max() == pytest.approx(1.0)


def test_classification_is_a_parameter(block: str) -> None:
    settings = parse_settings({"classification": {"min_area": 0.3, "lean": 0.0}})
    snapshot = taken_in(block, Pose(), settings)
    assert kinds(snapshot) == [SurfaceKind.SUPPORT]
    (rest,) = snapshot.obstacles
    assert len(rest.triangles) == 10


def test_package_of_a_share_folder(
    block: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "some_package" / "meshes").mkdir(parents=True)
    Path(block).rename(tmp_path / "some_package" / "meshes" / "block.stl")
    monkeypatch.setenv(PATH_VARIABLE, str(tmp_path))
    assert len(taken_in("package://some_package/meshes/block.stl", Pose()).surfaces) == 5
    assert len(taken_in("some_package/meshes/block.stl", Pose()).surfaces) == 5


def test_python_package(block: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    package = tmp_path / "meshes_for_a_test"
    package.mkdir()
    (package / "__init__.py").touch()
    Path(block).rename(package / "block.stl")
    monkeypatch.syspath_prepend(str(tmp_path))
    importlib.util.find_spec("meshes_for_a_test")
    assert len(taken_in("package://meshes_for_a_test/block.stl", Pose()).surfaces) == 5


@pytest.mark.parametrize(
    "mesh",
    [
        "",
        "/nowhere.stl",
        "/",
        "nowhere.stl",
        "package://",
        "package://no_such_package/a.stl",
        "package://json/no.stl",
        "package://../a.stl",
        "a\0b.stl",
        "/" + 5000 * "a",
    ],
)
def test_no_such_mesh(mesh: str) -> None:
    with pytest.raises(InvalidInput) as caught:
        snapshot_update(mesh, Pose(), 0.5, SETTINGS)
    assert (caught.value.field, caught.value.value) == ("mesh", mesh)


@pytest.mark.parametrize("content", [b"", b"solid\nendsolid", b"no mesh at all", bytes(84)])
def test_file_that_is_no_mesh(tmp_path: Path, content: bytes) -> None:
    file = tmp_path / "bad.stl"
    file.write_bytes(content)
    with pytest.raises(InvalidInput) as caught:
        snapshot_update(str(file), Pose(), 0.5, SETTINGS)
    assert caught.value.field == "mesh"


@pytest.mark.parametrize(
    ("friction", "pose", "field"),
    [
        (-0.1, Pose(), "friction"),
        (math.nan, Pose(), "friction"),
        (0.5, Pose(orientation=Quaternion(w=2.0)), "pose.orientation"),
        (0.5, Pose(position=Point(y=math.inf)), "pose.position"),
    ],
)
def test_refused(block: str, friction: float, pose: Pose, field: str) -> None:
    with pytest.raises(InvalidInput, match=f"^{re.escape(field)} "):
        snapshot_update(block, pose, friction, SETTINGS)


def test_too_many_triangles(block: str) -> None:
    with pytest.raises(InvalidInput, match="max_triangles is 11"):
        snapshot_update(block, Pose(), 0.5, parse_settings({"max_triangles": 11}))


def test_message_of_an_environment_is_that_environment(block: str) -> None:
    environment = Environment()
    before = environment.update(
        snapshot_update(block, Pose(position=Point(x=0.1)), 0.5, SETTINGS), SETTINGS
    )
    message = environment_message(before, Header(frame_id="map"))
    message = deserialize_message(serialize_message(message), type(message))
    after = environment.update(update_of_message(message, SETTINGS), SETTINGS)
    assert after.version == before.version
    fresh = Environment().update(update_of_message(message, SETTINGS), SETTINGS)
    assert [s.id for s in fresh.surfaces] == [s.id for s in before.surfaces]
    assert np.allclose(fresh.scene().triangles.sum(axis=1).sum(axis=0),
                       before.scene().triangles.sum(axis=1).sum(axis=0))  # fmt: skip


def test_setting_takes_a_mesh_or_polygons(block: str) -> None:
    request = SetEnvironment.Request(mesh=block, friction=0.5)
    environment = Environment()
    snapshot = environment.update(update_of_setting(request, SETTINGS), SETTINGS)
    message = environment_message(snapshot, Header())
    again = update_of_setting(SetEnvironment.Request(environment=message), SETTINGS)
    assert environment.update(again, SETTINGS).version == snapshot.version
    for wrong in (
        SetEnvironment.Request(),
        SetEnvironment.Request(mesh=block, environment=message),
    ):
        with pytest.raises(InvalidInput) as caught:
            update_of_setting(wrong, SETTINGS)
        assert caught.value.field == "mesh"
    message.header.frame_id = "odom"
    with pytest.raises(InvalidInput) as caught:
        update_of_setting(SetEnvironment.Request(environment=message), SETTINGS)
    assert caught.value.field == "environment.header.frame_id"
    change = SurfaceArray(is_diff=True, surfaces=message.surfaces)
    with pytest.raises(InvalidInput) as caught:
        update_of_setting(SetEnvironment.Request(environment=change), SETTINGS)
    assert caught.value.field == "environment.is_diff"
