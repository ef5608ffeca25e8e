"""Robot files: what they may say, and how a bad one is answered."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest

from rbprm_core.errors import InvalidInput
from rbprm_core.robot import RobotDescription, known_robots, load_description
from rbprm_core.robot.description import PlanarContact, PointContact
from rbprm_core.validation import parse_record
from rbprm_core.vocabulary import SurfaceKind

LIMBS = {"hyq": 4, "anymal": 4, "talos": 2}


def content() -> dict[str, Any]:
    return tomllib.loads(known_robots()["hyq"].read_text())


@pytest.mark.parametrize("name", sorted(known_robots()))
def test_the_robots_of_the_package_are_good(name: str) -> None:
    text = load_description(name)
    assert text.name == name
    assert len(text.limbs) == LIMBS[name]


def test_hyq_anymal_and_talos_come_with_the_package() -> None:
    assert set(LIMBS) <= set(known_robots())


def test_a_users_own_file_by_path(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(known_robots()["hyq"].read_text().replace('name = "hyq"', 'name = "mine"'))
    text = load_description(str(file))
    assert text.name == "mine"
    assert text.limbs == load_description("hyq").limbs


def test_defaults() -> None:
    text = RobotDescription.model_validate(content())
    assert text.limbs[0].surfaces == (SurfaceKind.SUPPORT,)
    assert text.root_joints == ()
    assert isinstance(text.limbs[0].contact, PointContact)
    assert text.limbs[0].contact.center == (0, 0, 0)


def test_a_patch_lies_at_its_effector_unless_told_otherwise() -> None:
    data = changed("limbs.0.contact", {"type": "planar", "half_size": [0.1, 0.065]})
    contact = RobotDescription.model_validate(data).limbs[0].contact
    assert isinstance(contact, PlanarContact)
    assert contact.half_size == (0.1, 0.065)
    assert (contact.position, contact.orientation) == ((0, 0, 0), (0, 0, 0, 1))


def test_the_documented_contacts_are_contacts() -> None:
    page = (Path(__file__).parents[3] / "docs" / "robot_file.md").read_text()
    written = re.findall(r"^contact = .*$", page, re.MULTILINE)
    kinds = []
    for line in written:
        data = changed("limbs.0.contact", tomllib.loads(line)["contact"])
        kinds.append(RobotDescription.model_validate(data).limbs[0].contact.type)
    assert sorted(set(kinds)) == ["planar", "point"]


@pytest.mark.parametrize("name", ["unicorn", "/no/such/robot.toml", ""])
def test_an_unknown_robot_lists_the_known_ones(name: str) -> None:
    with pytest.raises(InvalidInput, match=r"anymal, .*hyq") as caught:
        load_description(name)
    assert (caught.value.field, caught.value.value) == ("robot", name)


@pytest.mark.parametrize("text", ["name = ", "\\x00\\x01", "[[[["])
def test_a_file_that_is_no_toml(tmp_path: Path, text: str) -> None:
    file = tmp_path / "bad.toml"
    file.write_text(text)
    with pytest.raises(InvalidInput, match="TOML"):
        load_description(str(file))


def test_a_binary_file_is_no_toml(tmp_path: Path) -> None:
    file = tmp_path / "bad.toml"
    file.write_bytes(bytes(range(256)))
    with pytest.raises(InvalidInput, match="TOML"):
        load_description(str(file))


def changed(path: str, value: Any) -> dict[str, Any]:
    """HyQ's file with one value replaced."""
    data = content()
    *outer, last = path.split(".")
    place: Any = data
    for key in outer:
        place = place[int(key)] if isinstance(place, list) else place[key]
    place[last] = value
    return data


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("colour", "red"),
        ("name", 3),
        ("urdf", 7),
        ("limbs", []),
        ("limbs.0.samples", 10),
        ("limbs.0.samples", 10**9),
        ("limbs.1.surfaces", []),
        ("limbs.1.surfaces", ["ceiling"]),
        ("limbs.2.contact.radius", -0.1),
        ("limbs.2.contact.radius", float("nan")),
        ("limbs.2.contact.type", "suction"),
        ("limbs.2.contact.center", [0.0, 0.0]),
        ("limbs.2.contact.center", [0.0, 0.0, float("inf")]),
        ("limbs.3.heuristics", {"manipulability": float("nan")}),
        ("limbs.3.finger", 1),
        ("volumes.trunk_links", []),
        ("volumes.trunk_scale", 0.5),
        ("volumes.trunk_scale", float("inf")),
        ("volumes.samples", 1),
        ("volumes.faces", 3),
        ("joint_ranges", {"lf_haa_joint": [float("nan"), 1.0]}),
        ("seed", -1),
    ],
)
def test_a_bad_value_names_its_field(field: str, value: Any) -> None:
    with pytest.raises(InvalidInput) as caught:
        parse_record(RobotDescription, changed(field, value), "robot")
    assert caught.value.field.startswith(f"robot.{field}")


@pytest.mark.parametrize(
    ("key", "value", "field"),
    [
        ("half_size", [0.1], "half_size.1"),
        ("half_size", [0.1, 0.0], "half_size.1"),
        ("half_size", [float("nan"), 0.1], "half_size.0"),
        ("position", [0.0, 0.0], "position.2"),
        ("orientation", [0.0, 0.0, 1.0], "orientation.3"),
        ("radius", 0.1, "radius"),
        ("type", "suction", "type"),
        ("type", None, "type"),
    ],
)
def test_a_bad_value_of_a_patch_names_its_field(key: str, value: Any, field: str) -> None:
    contact = {"type": "planar", "half_size": [0.1, 0.065], key: value}
    with pytest.raises(InvalidInput) as caught:
        parse_record(RobotDescription, changed("limbs.1.contact", contact), "robot")
    assert caught.value.field == f"robot.limbs.1.contact.{field}"


def test_a_contact_without_a_type() -> None:
    with pytest.raises(InvalidInput, match="type") as caught:
        parse_record(RobotDescription, changed("limbs.1.contact", {"radius": 0.1}), "robot")
    assert caught.value.field == "robot.limbs.1.contact.type"


def test_a_missing_field_is_named() -> None:
    data = content()
    del data["limbs"][2]["effector"]
    with pytest.raises(InvalidInput, match="required") as caught:
        parse_record(RobotDescription, data, "robot")
    assert caught.value.field == "robot.limbs.2.effector"


def test_limbs_must_have_names_of_their_own() -> None:
    with pytest.raises(InvalidInput, match="limb names must differ"):
        parse_record(RobotDescription, changed("limbs.1.name", "lf_leg"))


@pytest.mark.parametrize("ends", [[1.0, 0.5], [0.3, 0.3]])
def test_an_empty_range_of_a_joint_is_refused(ends: list[float]) -> None:
    with pytest.raises(InvalidInput, match="lf_haa_joint is empty"):
        parse_record(RobotDescription, changed("joint_ranges", {"lf_haa_joint": ends}))
