"""Scenario files: known ones, a user's own, and every sort of bad one."""

from __future__ import annotations

import tomllib
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rbprm_core.errors import InvalidInput
from rbprm_core.request import StageNames
from rbprm_core.robot import Robot, load_description
from rbprm_core.robot.limb import Limb
from rbprm_core.scenario import Scenario, known_scenarios, load_scenario, parse_scenario
from rbprm_core.surface_kind import SurfaceKind

NAN, INF = float("nan"), float("inf")
MESH = {"file": "hpp_environments/meshes/multicontact/ground.stl"}
SQUARE = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]]


@lru_cache
def robot_of(name: str) -> Robot:
    """A robot of the package, read once: several scenarios are for the same."""
    return Robot.load(load_description(name))


def limbs_of(robot: Robot) -> dict[str, Limb]:
    return {limb.name: limb for limb in robot.limbs}


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
    return parse_scenario(data)


def changed(path: str, value: Any) -> dict[str, Any]:
    data = content()
    *outer, last = path.split(".")
    place: Any = data
    for key in outer:
        place = place[int(key)] if isinstance(place, list) else place.setdefault(key, {})
    place[last] = value
    return data


@pytest.mark.parametrize("name", sorted(known_scenarios()))
def test_the_scenarios_of_the_package_are_good(name: str) -> None:
    text = load_scenario(name)
    assert text.name == name
    for robot in map(text.load_robot, (text.robot, *text.robots)):
        request = text.request_for(robot, seed=3)
        assert request.seed == 3
        limbs = {limb.name for limb in robot.limbs}
        assert limbs.issuperset(request.required_limbs + request.start_limbs)
        assert request.start_limbs
        assert request.robustness_threshold >= 0
        for place in (request.start, request.goal):
            assert (request.bounds.low <= place.position).all()
            assert (request.bounds.high >= place.position).all()
        kinds = {surface.kind for surface in text.scene().surfaces}
        for limb in request.required_limbs:
            assert kinds.intersection(limbs_of(robot)[limb].surfaces)


@pytest.mark.parametrize(
    ("name", "robot", "threshold"),
    [
        ("rubble", "hyq", 10.0),
        ("rubble", "anymal", 3.5),
        ("rubble_half", "go2", 2.0),
        ("rubble_three_quarters", "anymal", 3.5),
        ("slalom", "hyq", 10.0),
        ("race", "hyq", 10.0),
        ("stairs10", "talos", 2.0),
    ],
)
def test_thresholds_of_the_scenarios(name: str, robot: str, threshold: float) -> None:
    assert load_scenario(name).request_for(robot_of(robot)).robustness_threshold == threshold


def test_the_papers_numbers(hyq: Robot) -> None:
    request = load_scenario("rubble").request_for(hyq)
    assert request.start.position == pytest.approx([-2, 0, 0.63])
    assert request.goal.position == pytest.approx([3, 0, 0.63])
    assert load_scenario("rubble").request_text("hyq").time_limit == 60


def test_heuristics_of_the_scenarios_robot() -> None:
    weights = {"lf_leg": {"effort": 1.0, "joint_limits": 0.2}}
    data = {**content(), "heuristics": weights}
    own = parse(data).load_robot()
    assert own.limbs[0].heuristics == weights["lf_leg"]
    plain = parse(content()).load_robot()
    assert own.limbs[1].heuristics == plain.limbs[1].heuristics
    other = parse(data).load_robot("anymal")  # it keeps those of its own file
    assert all("effort" not in limb.heuristics for limb in other.limbs)


def humanoid(**changes: Any) -> dict[str, Any]:
    """A scenario of Talos on one polygon."""
    return {**content(), "robot": "talos", **changes}


def test_limbs_and_root_joints_of_the_scenarios_robot() -> None:
    plain = parse(humanoid()).load_robot()
    assert [limb.name for limb in plain.limbs] == ["left_leg", "right_leg"]
    assert plain.root_joints == ()
    chosen = humanoid(limbs=["right_arm", "left_leg"], root_joints=["torso_1_joint"])
    own = parse(chosen).load_robot()
    assert [limb.name for limb in own.limbs] == ["left_leg", "right_arm"]
    assert own.root_joints == (own.model.getJointId("torso_1_joint"),)
    assert len(own.root_index) == 8
    assert limbs_of(own)["right_arm"].base != limbs_of(plain)["left_leg"].base
    request = parse(chosen).request_for(own)
    assert request.required_limbs == request.start_limbs == ("left_leg", "right_arm")
    with pytest.raises(InvalidInput, match="unknown") as caught:
        parse(
            {**chosen, "request": {**chosen["request"], "required_limbs": ["right_leg"]}}
        ).request_for(own)
    assert caught.value.field == "request.required_limbs.0"


def test_another_robot_keeps_its_own_limbs_surfaces_and_trunk() -> None:
    text = parse(
        humanoid(
            limbs=["left_arm"],
            root_joints=["torso_1_joint"],
            surfaces={"left_arm": ["lean"]},
            trunk={"scale": 2.0},
        )
    )
    other = text.load_robot("hyq")
    plain = robot_of("hyq")
    assert [limb.name for limb in other.limbs] == [limb.name for limb in plain.limbs]
    assert other.description == plain.description


def test_surfaces_and_trunk_of_the_scenarios_robot() -> None:
    data = content()
    data["surfaces"] = {"lf_leg": ["support", "lean"]}
    data["trunk"] = {"links": ["trunk", "lf_upperleg"], "scale": 1.5}
    own, plain = parse(data).load_robot(), robot_of("hyq")
    assert own.limbs[0].surfaces == (SurfaceKind.SUPPORT, SurfaceKind.LEAN)
    assert own.limbs[1].surfaces == plain.limbs[1].surfaces
    volumes = own.description.volumes
    assert (volumes.trunk_links, volumes.trunk_scale) == (("trunk", "lf_upperleg"), 1.5)
    data["trunk"] = {"scale": 1.5}
    volumes = parse(data).load_robot().description.volumes
    assert volumes.trunk_links == plain.description.volumes.trunk_links


def test_old_names_of_options_work_with_a_warning() -> None:
    data = {**content(), "options": {"sequence": {"least_step": 0.02}}}
    data["options"]["generator"] = {"most_robust": True}
    data["options"]["guide"] = {"planner": "prm"}
    data["environment"]["classification"] = {"least_area": 0.01}
    with pytest.warns(FutureWarning) as warned:
        text = parse(data)
    warnings_shown = [str(warning.message) for warning in warned]
    assert len(warnings_shown) == 4
    for old, new in (
        ("options.sequence.least_step", "options.sequence.min_step"),
        ("options.generator.most_robust", "options.generator.accept_below_threshold"),
        ("options.guide.planner", "stages.guide"),
        ("environment.classification.least_area", "environment.classification.min_area"),
    ):
        assert any(line.startswith(f"{old} is now called {new};") for line in warnings_shown)
    assert text.options.sequence.min_step == 0.02
    assert text.stages.guide == "prm"
    assert text.options.generator.accept_below_threshold
    assert text.environment.classification.min_area == 0.01


@pytest.mark.parametrize(
    ("changes", "field", "reason"),
    [
        ({"limbs": ["tail"]}, "limbs", "left_leg, right_leg"),
        ({"limbs": []}, "limbs", "names no limb"),
        ({"limbs": ["left_leg", "left_leg_toes"]}, "limbs", "choose one of them"),
        ({"root_joints": ["tail"]}, "robot.root_joints", "unknown joint"),
        ({"root_joints": ["leg_left_1_joint"]}, "robot.root_joints", "joint of limb left_leg"),
        ({"surfaces": {"left_arm": ["lean"]}}, "surfaces", "left_leg, right_leg"),  # not chosen
        ({"heuristics": {"left_arm": {"effort": 1.0}}}, "heuristics", "left_leg, right_leg"),
    ],
)
def test_a_choice_that_the_robot_does_not_have(
    changes: dict[str, Any], field: str, reason: str
) -> None:
    with pytest.raises(InvalidInput, match=reason) as caught:
        parse(humanoid(**changes)).load_robot()
    assert caught.value.field == field


@pytest.mark.parametrize(
    ("name", "limbs", "trunk"),
    [
        ("stairs", {"left_leg", "right_leg", "right_arm"}, 5),
        ("stairs15", {"left_leg", "right_leg"}, 5),
        ("standing", {"left_leg", "right_leg", "left_arm", "right_arm"}, 5),
        ("car", {"left_leg", "right_leg", "left_arm", "right_arm"}, 7),
    ],
)
def test_the_papers_scenarios_of_a_humanoid(name: str, limbs: set[str], trunk: int) -> None:
    """Section 6.1: with their arms the torso turns too; the car's trunk has the upper legs."""
    text = load_scenario(name)
    robot = text.load_robot()
    assert {limb.name for limb in robot.limbs} == limbs
    assert len(robot.root_joints) == (0 if limbs == {"left_leg", "right_leg"} else 2)
    assert len(robot.description.volumes.trunk_links) == trunk
    request = text.request_for(robot)
    assert set(request.required_limbs) == {"left_leg", "right_leg"}
    assert set(request.start_limbs) <= limbs


def test_limbs_asked_for_at_the_goal(hyq: Robot) -> None:
    assert parse(content()).request_for(hyq).goal_limbs is None
    request = parse(content(goal_limbs=["rh_leg", "lf_leg"])).request_for(hyq)
    assert request.goal_limbs == ("rh_leg", "lf_leg")
    with pytest.raises(InvalidInput, match="is named twice"):
        parse(content(goal_limbs=["rh_leg", "rh_leg"])).request_for(hyq)


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
        ("request.required_limbs", "lf_leg"),
        ("environment.surfaces.0.friction", -0.1),
        ("environment.surfaces.0.friction", NAN),
        ("environment.surfaces.0.colour", "red"),
        ("environment.meshes", [{"file": "a.stl", "friction": -0.5}]),
        ("environment.meshes", [{"file": "a.stl", "scale": 2.0}]),
        ("environment.meshes", [{"translation": [0, 0, 0]}]),
        ("environment.classification", {"support": NAN}),
        ("environment.classification", {"suport": 0.3}),
        ("options", {"shortcut": 3}),
        ("options.guide.rrt", {"step": 0.0}),
        ("options.guide.rrt", {"iterations": 0}),
        ("options.guide.prm", {"neighbours": 0}),
        ("options.guide", {"resolution": INF}),
        ("options.guide", {"search": "astar"}),
        ("stages", {"guide": 3}),
        ("stages", {"legs": "rrt"}),
        ("options.sequence", {"step": NAN}),
        ("options.sequence", {"steps": 0.1}),
        ("options.generator", {"candidates": -1}),
        ("limbs", "lf_leg"),
        ("root_joints", [3]),
        ("surfaces", {"lf_leg": []}),
        ("surfaces", {"lf_leg": ["ceiling"]}),
        ("trunk", {"scale": 0.9}),
        ("trunk", {"scale": NAN}),
        ("trunk", {"links": []}),
        ("trunk", {"link": ["trunk"]}),
        ("robots.anymal", {"time_limit": -2.0}),
        ("robots.anymal", {"colour": "red"}),
        ("robots.anymal", {"gravity": [0.0, 0.0, -101.0]}),
        ("request.start.position", [0.0, 1e30, 0.6]),
        ("request.bounds.z", [-1e30, 1.0]),
        ("request.bounds.yaw", 7.0),
        ("request.gravity", [0.0, 0.0, -1e30]),
        ("request.gravity", [0.0, 0.0, NAN]),
        ("request.grip_force", 1e30),
        ("request.robustness_threshold", 1e30),
        ("request.time_limit", 1e30),
        ("environment.surfaces.0.friction", 1e30),
        ("options.guide", {"shortcuts": 10**30}),
        ("options", {"guides": 10**30}),
        ("options.guide", {"resolution": 1e-30}),
        ("options.guide.rrt", {"step": 1e30}),
        ("options.guide.rrt", {"iterations": 10**30}),
        ("options.guide.prm", {"neighbours": 10**30}),
        ("options.sequence", {"step": 1e30}),
        ("options.sequence", {"min_step": 1e-30}),
        ("options.sequence", {"look_ahead": 1e30}),
        ("options.sequence", {"root_slack": 1e30}),
        ("options.generator", {"band": 1e30}),
        ("options.generator", {"spacing": 1e-30}),
        ("options.generator", {"candidates": 10**30}),
        ("trunk", {"scale": 1e30}),
        ("heuristics.lf_leg", {"effort": 1e30}),
    ],
)
def test_a_bad_value_names_its_field(field: str, value: Any) -> None:
    with pytest.raises(InvalidInput) as caught:
        parse(changed(field, value))
    assert field in caught.value.field or caught.value.field.endswith(field)


@pytest.mark.parametrize(("robot", "meant"), [("anymall", "anymal"), ("HyQ", "hyq")])
def test_changes_for_a_robot_whose_name_is_misspelt(hyq: Robot, robot: str, meant: str) -> None:
    text = parse({**content(), "robots": {robot: {"time_limit": 5.0}}})
    for ask in (lambda: text.request_text("hyq"), lambda: text.request_for(hyq)):
        with pytest.raises(InvalidInput, match=f"unknown; did you mean {meant}?") as caught:
            ask()
        assert (caught.value.field, caught.value.value) == ("robots", robot)


def test_changes_for_a_robot_without_a_name() -> None:
    with pytest.raises(InvalidInput, match=r"scenario\.robots"):
        parse({**content(), "robots": {"": {"time_limit": 5.0}}})


def test_changes_for_a_users_own_robot() -> None:
    """Known by their files alone: another's changes do not stand in the way of a known robot."""
    text = parse({**content(), "robots": {"mine": {"time_limit": 5.0}, "g2": {}}})
    assert text.request_text("mine").time_limit == 5.0
    assert text.request_text("hyq").time_limit == content()["request"].get("time_limit", 60.0)


@pytest.mark.parametrize(
    ("request_", "field", "reason"),
    [
        ({"required_limbs": ["lf_leg", "tail"]}, "request.required_limbs.1", "lf_leg, rf_leg"),
        ({"start_limbs": ["wing"]}, "request.start_limbs.0", "unknown"),
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
            {"meshes": [{**MESH, "rotation": [[1e200, 1e200, 0], [-1e200, 1e200, 0], [0, 0, 1]]}]},
            "environment.meshes.0.rotation",
            "rotation matrix",
        ),
        (
            {"meshes": [{**MESH, "translation": [0, 0, 1e30]}]},
            "environment.meshes.0.translation",
            "within",
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
    robot = found.load_robot()
    assert found.request_for(robot).goal_limbs
    assert {limb.name for limb in robot.limbs} == set(found.limbs or ())


def edits(**text: Any) -> dict[str, Any]:
    return {**content(), "edits": [{"name": "edit", "at": 0.5, **text}]}


def test_edits_add_change_and_remove_surfaces() -> None:
    high = [[x, y, 0.2] for x, y, _ in SQUARE]
    scenario = parse(edits(surfaces=[{"id": "new", "vertices": high}], removed=["g"]))
    scene = scenario.scene()
    edited = scenario.edited(scene, 0)
    assert set(scene.index) == {"g"}
    assert set(edited.index) == {"new"}
    changed = parse(edits(surfaces=[{"id": "g", "vertices": high}])).edited(scene, 0)
    assert changed.surfaces[0].polygon.boundary[:, 2] == pytest.approx(0.2)


@pytest.mark.parametrize(
    ("text", "field"),
    [
        ({"at": 1.0}, "scenario.edits.0.at"),
        ({"at": NAN}, "scenario.edits.0.at"),
        ({"remove": ["g"]}, "scenario.edits.0.remove"),
        ({"surfaces": [{"id": "new"}]}, "scenario.edits.0.surfaces.0.vertices"),
    ],
)
def test_bad_edits_are_named(text: dict[str, Any], field: str) -> None:
    with pytest.raises(InvalidInput) as caught:
        parse(edits(**text))
    assert caught.value.field == field


@pytest.mark.parametrize(
    ("text", "field"),
    [
        ({"removed": ["moon"]}, "removed"),
        ({"surfaces": [{"id": "new", "vertices": SQUARE[:2]}]}, "edits.0.surfaces.0.vertices"),
    ],
)
def test_edits_that_cannot_be_done_are_named(text: dict[str, Any], field: str) -> None:
    scenario = parse(edits(**text))
    with pytest.raises(InvalidInput) as caught:
        scenario.edited(scenario.scene(), 0)
    assert caught.value.field == field


def test_stages_by_name(hyq: Robot) -> None:
    data = {**content(), "stages": {"guide": "prm", "contacts": "along_guide"}}
    assert parse(data).request_for(hyq).stages == StageNames("prm", "along_guide")
    with pytest.raises(InvalidInput, match="rrt, prm") as caught:
        parse({**content(), "stages": {"guide": "astar"}}).request_for(hyq)
    assert caught.value.field == "stages.guide"


def test_contradictory_options_name_both_fields(hyq: Robot) -> None:
    data = {**content(), "options": {"sequence": {"step": 0.05, "min_step": 0.1}}}
    with pytest.raises(InvalidInput, match=r"options\.sequence\.step = 0\.05") as caught:
        parse(data).request_for(hyq)
    assert caught.value.field == "options.sequence.min_step"
