"""Files of installed packages, by names that do not depend on the machine."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from rbprm_core.errors import InvalidInput
from rbprm_core.resources import find_resource, share_folders

HYQ = "example-robot-data/robots/hyq_description/robots/hyq_no_sensors.urdf"


def test_a_packages_file() -> None:
    path = find_resource(HYQ, "robot.urdf")
    assert path.is_absolute()
    assert path.is_file()


def test_an_absolute_path_is_itself(tmp_path: Path) -> None:
    file = tmp_path / "a.urdf"
    file.write_text("")
    assert find_resource(str(file), "robot.urdf") == file


def test_ones_own_folders_come_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folders = [tmp_path / name for name in ("first", "absent", "second")]
    for folder in (folders[0], folders[2]):
        (folder / HYQ).parent.mkdir(parents=True)
        (folder / HYQ).write_text(folder.name)
    monkeypatch.setenv("RBPRM_SHARE_PATH", os.pathsep.join(map(str, folders)))
    assert share_folders()[:2] == [folders[0], folders[2]]
    assert find_resource(HYQ, "robot.urdf").read_text() == "first"
    (folders[0] / HYQ).unlink()
    assert find_resource(HYQ, "robot.urdf").read_text() == "second"


def test_the_share_of_a_ros_prefix(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "share" / "mine" / "a.stl"
    file.parent.mkdir(parents=True)
    file.write_text("")
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path))
    assert find_resource("mine/a.stl", "mesh.file") == file


@pytest.mark.parametrize("name", ["no/such.urdf", "/no/such.urdf", "."])
def test_what_is_not_there(name: str) -> None:
    with pytest.raises(InvalidInput, match="RBPRM_SHARE_PATH") as caught:
        find_resource(name, "robot.urdf")
    assert (caught.value.field, caught.value.value) == ("robot.urdf", name)
