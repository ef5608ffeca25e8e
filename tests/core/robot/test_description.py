"""Robot files: their keys, and the errors of invalid ones."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest

from rbprm_core.errors import InvalidInput
from rbprm_core.robot import RobotDescription, known_robots, load_description
from rbprm_core.robot.description import PlanarContact, PointContact
from rbprm_core.surface_kind import SurfaceKind
from rbprm_core.validation import parse_record

LIMBS = {"allegro": 3, "hyq": 4, "anymal": 4, "go2": 4, "g1": 2, "talos": 2}  # used by default


def content() -> dict[str, Any]:
    return tomllib.loads(known_robots()["hyq"].read_text())


@pytest.mark.parametrize("name", sorted(known_robots()))
def test_the_robots_of_the_package_are_good(name: str) -> None:
    text = load_description(name)
    assert text.name == name
    assert len(text.using().limbs) == LIMBS.get(name, len(text.default_limbs or text.limbs))


def test_these_robots_come_with_the_package() -> None:
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


def test_the_documented_example_is_a_robot() -> None:
    page = (Path(__file__).parents[3] / "docs" / "robot_file.md").read_text()
    blocks = [block.split("```")[0] for block in page.split("```toml")[1:]]
    whole = parse_record(RobotDescription, tomllib.loads(blocks[0]), "robot")
    assert whole.name == "my_robot"
    assert len(whole.using().limbs) == 1
    shared = next(tomllib.loads(block) for block in blocks if "left_leg_toes" in block)
    text = parse_record(RobotDescription, {**content(), **shared})
    assert [limb.name for limb in text.using().limbs] == ["left_leg"]


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


ARMS = ("left_arm", "right_arm")


def test_the_limbs_that_are_used() -> None:
    text = load_description("talos")
    names = [limb.name for limb in text.limbs]
    assert text.default_limbs == ("left_leg", "right_leg")
    assert [limb.name for limb in text.using().limbs] == ["left_leg", "right_leg"]
    chosen = text.using(["right_arm", "left_leg"], ["torso_1_joint"])
    assert [limb.name for limb in chosen.limbs] == ["left_leg", "right_arm"]  # the file's order
    assert chosen.root_joints == ("torso_1_joint",)
    assert chosen.using().limbs == chosen.limbs  # no longer the file's choice
    assert text.using(names).limbs == text.limbs
    assert len(text.limbs) == len(names)  # the first is as it was
    everything = load_description("hyq")
    assert everything.using().limbs == everything.limbs


@pytest.mark.parametrize(
    ("limbs", "value", "reason"),
    [(["left_leg", "tail"], "tail", "left_leg, right_leg"), ([], [], "names no limb")],
)
def test_limbs_that_cannot_be_used(limbs: list[str], value: Any, reason: str) -> None:
    with pytest.raises(InvalidInput, match=reason) as caught:
        load_description("talos").using(limbs)
    assert (caught.value.field, caught.value.value) == ("limbs", value)


def test_other_heuristics_and_surfaces_for_some_limbs() -> None:
    text = load_description("talos").using(["left_leg", *ARMS])
    kinds = (SurfaceKind.LEAN, SurfaceKind.OTHER)
    changed_ = text.with_heuristics({"left_arm": {"effort": 2.0}}).with_surfaces(
        {"right_arm": kinds}
    )
    leg, left, right = changed_.limbs
    assert leg == text.limbs[0]
    assert (left.heuristics, left.surfaces) == ({"effort": 2.0}, text.limbs[1].surfaces)
    assert (right.heuristics, right.surfaces) == (text.limbs[2].heuristics, kinds)
    assert text.with_heuristics({}).with_surfaces({}) == text


def test_a_limb_that_is_not_used_has_nothing_to_change() -> None:
    text = load_description("talos").using()
    with pytest.raises(InvalidInput) as caught:
        text.with_heuristics({"left_arm": {"effort": 2.0}})
    assert (caught.value.field, caught.value.value) == ("heuristics", "left_arm")
    with pytest.raises(InvalidInput) as caught:
        text.with_surfaces({"left_arm": (SurfaceKind.LEAN,)})
    assert (caught.value.field, caught.value.value) == ("surfaces", "left_arm")


def test_another_trunk() -> None:
    text = load_description("hyq")
    assert text.with_trunk(None, None) == text
    assert text.with_trunk(("trunk", "lf_upperleg"), None).volumes.trunk_scale == (
        text.volumes.trunk_scale
    )
    larger = text.with_trunk(None, 1.6).volumes
    assert (larger.trunk_links, larger.trunk_scale) == (text.volumes.trunk_links, 1.6)
    assert larger.samples == text.volumes.samples


def test_default_limbs_are_limbs() -> None:
    with pytest.raises(InvalidInput, match="default_limbs names tail; known: lf_leg"):
        parse_record(RobotDescription, {**content(), "default_limbs": ["lf_leg", "tail"]})
    with pytest.raises(InvalidInput):
        parse_record(RobotDescription, {**content(), "default_limbs": []})


@pytest.mark.parametrize("ends", [[1.0, 0.5], [0.3, 0.3]])
def test_an_empty_range_of_a_joint_is_refused(ends: list[float]) -> None:
    with pytest.raises(InvalidInput, match="lf_haa_joint is empty"):
        parse_record(RobotDescription, changed("joint_ranges", {"lf_haa_joint": ends}))


def test_a_limb_has_a_heuristic() -> None:
    text = content()
    text["limbs"][0]["heuristics"] = {}
    with pytest.raises(InvalidInput, match="heuristics"):
        parse_record(RobotDescription, text, "robot")
