"""Scenario files: known ones, a user's own, and every sort of bad one."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rbprm_core.errors import InvalidInput
from rbprm_core.robot import Robot
from rbprm_core.scenario import Scenario, known_scenarios, load_scenario
from rbprm_core.validation import parse_record
from rbprm_core.vocabulary import SurfaceKind

NAN, INF = float("nan"), float("inf")
SQUARE = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]]


THRESHOLDS = {"hyq": 10.0, "talos": 2.0}


@pytest.fixture(scope="module")
def robots(hyq: Robot, talos: Robot) -> dict[str, Robot]:
    """The robots that the package's scenarios are for."""
    return {"hyq": hyq, "talos": talos}


def content(**request: Any) -> dict[str, Any]:
    """A small scenario on one polygon, with some of its request replaced."""
    return {
        "name": "mine",
        "robot": "hyq",
        "environment": {"surfaces": [{"id": "g", "vertices": SQUARE, "friction": 0.5}]},
        "request": {
            "start": {"position": [0.0, 0.0, 0.6]},
            "goal": {"position": [0.5, 0.0, 0.6]},
            "bounds": {
                "x": [-1.0, 1.0], "y": [-1.0, 1.0], "z": [0.0, 1.0],
                "yaw": 0.4, "pitch": 0.2, "roll": 0.2,
            },
            **request,
        },
    }  # fmt: skip


def parse(data: dict[str, Any]) -> Scenario:
    return parse_record(Scenario, data, "scenario")


def changed(path: str, value: Any) -> dict[str, Any]:
    data = content()
    *outer, last = path.split(".")
    place: Any = data
    for key in outer:
        place = place[int(key)] if isinstance(place, list) else place.setdefault(key, {})
    place[last] = value
    return data


@pytest.mark.parametrize("name", sorted(known_scenarios()))
def test_the_scenarios_of_the_package_are_good(name: str, robots: dict[str, Robot]) -> None:
    text = load_scenario(name)
    assert text.name == name
    robot = robots[text.robot]
    request = text.request_for(robot, seed=3)
    assert request.seed == 3
    assert request.required == request.start_limbs == tuple(limb.name for limb in robot.limbs)
    assert request.robustness_threshold == THRESHOLDS[text.robot]
    assert (request.bounds.low <= request.start.position).all()
    assert (request.bounds.high >= request.goal.position).all()
    kinds = [surface.kind for surface in text.scene().surfaces]
    assert SurfaceKind.SUPPORT in kinds


def test_the_papers_numbers(hyq: Robot) -> None:
    request = load_scenario("rubble").request_for(hyq)
    assert request.start.position == pytest.approx([-2, 0, 0.63])
    assert request.goal.position == pytest.approx([3, 0, 0.63])
    assert load_scenario("rubble").request_text("hyq").time_limit == 60


def test_another_robot_changes_what_it_must() -> None:
    text = load_scenario("rubble")
    own, other = text.request_text("hyq"), text.request_text("anymal")
    assert other.start.position != own.start.position
    assert other.bounds == own.bounds
    assert text.request_text("a stranger") == own


def test_a_users_own_file(tmp_path: Path, hyq: Robot) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(known_scenarios()["flat"].read_text().replace("0.5", "0.7"))
    scene = load_scenario(str(file)).scene()
    assert {surface.friction for surface in scene.surfaces} == {0.7}


def test_polygons_and_meshes_together() -> None:
    data = content()
    data["environment"]["meshes"] = [
        {"file": "hpp_environments/meshes/multicontact/ground.stl", "translation": [0, 0, -1]}
    ]
    scene = parse(data).scene()
    assert "g" in scene.index
    assert len(scene.surfaces) > 1


def test_defaults(hyq: Robot) -> None:
    request = parse(content()).request_for(hyq)
    assert request.gravity == pytest.approx([0, 0, -9.81])
    assert request.start.orientation == pytest.approx([0, 0, 0, 1])
    assert request.robustness_threshold == 0
    assert parse(content()).request_for(hyq, robustness_threshold=7.0).robustness_threshold == 7.0


@pytest.mark.parametrize("name", ["moon", "/no/such/scenario.toml"])
def test_an_unknown_scenario_lists_the_known_ones(name: str) -> None:
    with pytest.raises(InvalidInput, match=r"flat, .*rubble") as caught:
        load_scenario(name)
    assert (caught.value.field, caught.value.value) == ("scenario", name)


def test_a_file_that_is_no_toml(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text("name = [")
    with pytest.raises(InvalidInput, match="TOML"):
        load_scenario(str(file))


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("colour", "red"),
        ("request.start.position", [NAN, 0.0, 0.6]),
        ("request.goal.position", [0.0, INF, 0.6]),
        ("request.goal.position", [0.0, 0.6]),
        ("request.goal.position", "there"),
        ("request.start.orientation", [0.0, 0.0, 0.0, NAN]),
        ("request.start.heading", 0.0),
        ("request.time_limit", -1.0),
        ("request.time_limit", 0.0),
        ("request.time_limit", NAN),
        ("request.time_limit", INF),
        ("request.robustness_threshold", NAN),
        ("request.bounds.yaw", -0.1),
        ("request.bounds.x", [0.0, INF]),
        ("request.required", "lf_leg"),
        ("environment.surfaces.0.friction", -0.1),
        ("environment.surfaces.0.friction", NAN),
        ("environment.surfaces.0.colour", "red"),
        ("environment.meshes", [{"file": "a.stl", "friction": -0.5}]),
        ("environment.meshes", [{"file": "a.stl", "scale": 2.0}]),
        ("environment.meshes", [{"translation": [0, 0, 0]}]),
        ("environment.classification", {"support": NAN}),
        ("environment.classification", {"suport": 0.3}),
        ("options", {"shortcut": 3}),
        ("options.rrt", {"step": 0.0}),
        ("options.rrt", {"resolution": INF}),
        ("options.rrt", {"iterations": 0}),
        ("options.sequence", {"step": NAN}),
        ("options.sequence", {"steps": 0.1}),
        ("options.generator", {"candidates": -1}),
        ("robots.anymal", {"time_limit": -2.0}),
        ("robots.anymal", {"colour": "red"}),
    ],
)
def test_a_bad_value_names_its_field(field: str, value: Any) -> None:
    with pytest.raises(InvalidInput) as caught:
        parse(changed(field, value))
    assert field in caught.value.field or caught.value.field.endswith(field)


@pytest.mark.parametrize(
    ("request_", "field", "reason"),
    [
        ({"required": ["lf_leg", "tail"]}, "request.required", "lf_leg, rf_leg"),
        ({"start_limbs": ["wing"]}, "request.start_limbs", "unknown"),
        (
            {"start": {"position": [0, 0, 1], "orientation": [0, 0, 0, 0]}},
            "request.start.orientation",
            "norm is 0",
        ),
        (
            {"goal": {"position": [0, 0, 1], "orientation": [0, 0, 0, 3]}},
            "request.goal.orientation",
            "norm is 3",
        ),
        (
            {"bounds": {"x": [1, -1], "y": [0, 1], "z": [0, 1], "yaw": 0, "pitch": 0, "roll": 0}},
            "request.bounds.x",
            "empty",
        ),
    ],
)
def test_a_request_that_cannot_be(
    hyq: Robot, request_: dict[str, Any], field: str, reason: str
) -> None:
    with pytest.raises(InvalidInput, match=reason) as caught:
        parse(content(**request_)).request_for(hyq)
    assert caught.value.field == field


@pytest.mark.parametrize("value", [NAN, INF, -INF])
def test_a_threshold_must_be_finite(hyq: Robot, value: float) -> None:
    with pytest.raises(InvalidInput) as caught:
        parse(content()).request_for(hyq, robustness_threshold=value)
    assert caught.value.field == "robustness_threshold"


def test_a_limb_is_named_once(hyq: Robot) -> None:
    with pytest.raises(InvalidInput):
        parse(content(start_limbs=["lf_leg", "lf_leg", "rf_leg", "lh_leg"])).request_for(hyq)


@pytest.mark.parametrize(
    ("environment", "field", "reason"),
    [
        ({}, "environment", "neither"),
        ({"meshes": [{"file": "no/such.stl"}]}, "environment.meshes.0.file", "no such file"),
        (
            {
                "meshes": [
                    {
                        "file": "hpp_environments/meshes/multicontact/ground.stl",
                        "rotation": [[2, 0, 0], [0, 1, 0], [0, 0, 1]],
                    }
                ]
            },
            "environment.meshes.0.rotation",
            "rotation matrix",
        ),
        (
            {
                "meshes": [
                    {
                        "file": "hpp_environments/meshes/multicontact/ground.stl",
                        "rotation": [[-1, 0, 0], [0, 1, 0], [0, 0, 1]],
                    }
                ]
            },
            "environment.meshes.0.rotation",
            "rotation matrix",
        ),
        (
            {"surfaces": [{"id": "a", "vertices": SQUARE[:2]}]},
            "environment.surfaces.0.vertices",
            "three distinct",
        ),
        (
            {"surfaces": [{"id": "a", "vertices": SQUARE}, {"id": "a", "vertices": SQUARE}]},
            "surfaces",
            "this id",
        ),
        (
            {"surfaces": [{"id": "a", "vertices": SQUARE, "holes": [SQUARE[:2]]}]},
            "environment.surfaces.0.holes.0",
            "three distinct",
        ),
    ],
)
def test_an_environment_that_cannot_be(
    environment: dict[str, Any], field: str, reason: str
) -> None:
    data = content()
    data["environment"] = environment
    with pytest.raises(InvalidInput, match=reason) as caught:
        parse(data).scene()
    assert caught.value.field == field


def test_the_environment_of_a_plan_is_that_of_the_scenario() -> None:
    entry = load_scenario("rubble").environment_entry()
    assert entry.name == "rubble"
    assert [mesh.file for mesh in entry.meshes] == [
        "hpp_environments/meshes/multicontact/darpareduced.stl"
    ]
    assert np.array_equal(entry.meshes[0].rotation, np.eye(3))


def test_the_documented_example_is_a_scenario() -> None:
    page = Path(__file__).parents[2] / "docs" / "scenario_file.md"
    text = page.read_text().split("```toml")[1].split("```")[0]
    found = parse(tomllib.loads(text))
    assert found.name == "my_scenario"
    assert len(found.scene().surfaces) > 1
