"""The contact plan and its file."""

from __future__ import annotations

import json
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from rbprm_core.check import check_plan, count_transitions
from rbprm_core.errors import InvalidInput
from rbprm_core.outcome import Outcome
from rbprm_core.plan_conversion.states_to_plan import robot_entry, with_states
from rbprm_core.plan_record import FORMAT, ContactPlan
from rbprm_core.request import PlanRequest
from rbprm_core.robot import Robot
from rbprm_core.robot.data import RobotData

Document = dict[str, Any]
Outcomes = dict[int, tuple[PlanRequest, Outcome]]


@pytest.fixture(scope="module")
def plan(rubble_plans: dict[int, ContactPlan]) -> ContactPlan:
    return rubble_plans[0]


@pytest.fixture
def document(plan: ContactPlan) -> Document:
    """A plan of two states as it stands in the file."""
    text: Document = plan.model_copy(update={"states": plan.states[:2]}).model_dump(mode="json")
    return text


def write(folder: Path, document: Any) -> Path:
    file = folder / "plan.json"
    file.write_text(json.dumps(document))
    return file


def test_out_and_in_again(plan: ContactPlan, tmp_path: Path) -> None:
    file = tmp_path / "plan.json"
    plan.write(file)
    again = ContactPlan.read(file)
    assert again.model_dump() == plan.model_dump()
    copy = tmp_path / "copy.json"
    again.write(copy)
    assert copy.read_bytes() == file.read_bytes()


def test_the_keys_that_a_reader_may_count_on(plan: ContactPlan, tmp_path: Path) -> None:
    plan.write(tmp_path / "plan.json")
    text = json.loads((tmp_path / "plan.json").read_text())
    assert text["format"] == FORMAT == "rbprm-contact-plan/2"
    assert {"robot", "environment", "request", "guide", "states", "statistics"} <= text.keys()
    assert {"name", "urdf", "srdf", "joint_names"} <= text["robot"].keys()
    assert {"name", "meshes", "surfaces"} <= text["environment"].keys()
    assert {"start", "goal", "seed", "robustness_threshold", "gravity"} <= text["request"].keys()
    assert {"time", "counts", "versions"} <= text["statistics"].keys()
    assert {"guide", "shortcut", "sequence", "total"} <= text["statistics"]["time"].keys()
    state = text["states"][0]
    assert {"root", "joints", "com", "robustness", "contacts"} <= state.keys()
    assert state["root"].keys() >= {"position", "orientation"}
    assert state["contacts"][0].keys() >= {
        "limb", "frame", "frame_offset", "type", "position", "orientation",
        "normal", "points", "friction", "surface",
    }  # fmt: skip


def test_paths_are_relative(plan: ContactPlan) -> None:
    assert not Path(plan.robot.urdf).is_absolute()
    assert not any(Path(mesh.file).is_absolute() for mesh in plan.environment.meshes)


def test_the_file_says_what_the_planner_found(
    rubble_plans: dict[int, ContactPlan], outcomes: Outcomes, hyq: Robot
) -> None:
    data = hyq.model.createData()
    radii = {limb.name: limb.radius for limb in hyq.limbs}
    for seed, (request, outcome) in outcomes.items():
        plan = rubble_plans[seed]
        assert plan.request.seed == seed
        assert plan.request.robustness_threshold == request.robustness_threshold
        assert len(plan.guide) == len(outcome.guide.nodes)
        assert len(plan.states) == len(outcome.states)
        for entry, state in zip(plan.states, outcome.states, strict=True):
            q = np.array([*entry.root.position, *entry.root.orientation, *entry.joints])
            assert np.array_equal(q, state.q)
            assert entry.robustness == state.robustness
            assert entry.com == pytest.approx(pin.centerOfMass(hyq.model, data, q))
            pin.framesForwardKinematics(hyq.model, data, q)
            for contact in entry.contacts:
                frame = data.oMf[hyq.model.getFrameId(contact.frame)]
                offset = pin.XYZQUATToSE3(
                    np.array([*contact.frame_offset.position, *contact.frame_offset.orientation])
                )
                there = frame * offset
                assert there.translation == pytest.approx(contact.position, abs=1e-4)
                assert there.rotation[:, 2] == pytest.approx(contact.normal, abs=1e-6)
                assert contact.points == (contact.position,)
                radius = np.linalg.norm(contact.frame_offset.position)
                assert radius == pytest.approx(radii[contact.limb])


def test_transitions_are_counted(plan: ContactPlan) -> None:
    still = plan.model_copy(update={"states": (plan.states[0],) * 5})
    assert count_transitions(still) == 0
    lifted = plan.states[0].model_copy(update={"contacts": plan.states[0].contacts[1:]})
    up_and_down = plan.model_copy(update={"states": (plan.states[0], lifted, plan.states[0])})
    assert count_transitions(up_and_down) == 2
    assert 0 < count_transitions(plan) < len(plan.states)


def test_transitions_say_what_changes(plan: ContactPlan) -> None:
    assert len(plan.transitions) == len(plan.states) - 1
    assert sum(t.action != "none" for t in plan.transitions) == count_transitions(plan)
    for entry, (before, after) in zip(plan.transitions, pairwise(plan.states), strict=True):
        held = [{contact.limb for contact in state.contacts} for state in (before, after)]
        assert entry.witnesses == ()
        assert (entry.limb == "") == (entry.action == "none")
        assert (entry.action == "break") == (entry.limb in held[0] - held[1])
        assert (entry.action == "make") == (entry.limb in held[1] - held[0])
    shorter = with_states(plan, plan.states[:4])
    assert shorter.transitions == plan.transitions[:3]


def test_extra_keys_are_kept(document: Document, tmp_path: Path) -> None:
    document["note"] = "mine"
    document["states"][0]["contacts"][0]["force"] = 12.0
    document["robot"]["colour"] = "red"
    read = ContactPlan.read(write(tmp_path, document))
    read.write(tmp_path / "again.json")
    again = json.loads((tmp_path / "again.json").read_text())
    assert again["note"] == "mine"
    assert again["states"][0]["contacts"][0]["force"] == 12.0
    assert again["robot"]["colour"] == "red"


def test_optional_keys_may_be_left_out(document: Document, tmp_path: Path) -> None:
    del document["statistics"], document["robot"]["srdf"], document["environment"]["name"]
    del document["states"][0]["contacts"][0]["frame_offset"]
    read = ContactPlan.read(write(tmp_path, document))
    assert read.robot.srdf is None
    assert read.states[0].contacts[0].frame_offset.position == (0, 0, 0)


def test_a_plan_that_cannot_be_written(plan: ContactPlan, tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="cannot be written") as caught:
        plan.write(tmp_path / "no" / "such" / "plan.json")
    assert caught.value.field == "out"


@pytest.mark.parametrize(
    ("content", "field", "reason"),
    [
        (b"", "plan", "JSON"),
        (b"{", "plan", "JSON"),
        (b"\xff\xfe\x00", "plan", "JSON"),
        (b"solid box\nendsolid", "plan", "JSON"),
        (b"[]", "format", "plan file"),
        (b"3", "format", "plan file"),
        (b"null", "format", "plan file"),
        (b"{}", "format", "plan file"),
        (b'{"format": "rbprm-contact-plan/3"}', "format", "plan file"),
        (b'{"format": "rbprm-contact-plan/1"}', "robot", "required"),
        (b'{"format": "rbprm-contact-plan/2"}', "robot", "required"),
    ],
)
def test_a_file_that_is_no_plan(tmp_path: Path, content: bytes, field: str, reason: str) -> None:
    file = tmp_path / "plan.json"
    file.write_bytes(content)
    with pytest.raises(InvalidInput, match=reason) as caught:
        ContactPlan.read(file)
    assert caught.value.field == field


@pytest.mark.parametrize("name", ["absent.json", "."])
def test_a_file_that_cannot_be_read(tmp_path: Path, name: str) -> None:
    with pytest.raises(InvalidInput, match="cannot be read") as caught:
        ContactPlan.read(tmp_path / name)
    assert caught.value.field == "plan"


def spoilt(*path: str | int, value: Any = None, drop: bool = False) -> Callable[[Any], None]:
    def spoil(place: Any) -> None:
        for key in path[:-1]:
            place = place[key]
        if drop:
            del place[path[-1]]
        else:
            place[path[-1]] = value

    return spoil


@pytest.mark.parametrize(
    ("spoil", "field"),
    [
        (spoilt("states", drop=True), "states"),
        (spoilt("states", value={}), "states"),
        (spoilt("states", 1, "joints", 3, value=float("nan")), "states.1.joints.3"),
        (spoilt("states", 1, "robustness", value=float("inf")), "states.1.robustness"),
        (spoilt("states", 1, "robustness", value="high"), "states.1.robustness"),
        (spoilt("states", 0, "root", "position", value=[0, 0]), "states.0.root.position.2"),
        (spoilt("states", 0, "contacts", 0, "type", value="glue"), "states.0.contacts.0.type"),
        (spoilt("states", 0, "contacts", 2, "friction", value=-1), "states.0.contacts.2.friction"),
        (spoilt("states", 0, "contacts", 2, "limb", drop=True), "states.0.contacts.2.limb"),
        (
            spoilt("environment", "meshes", 0, "friction", value=-0.1),
            "environment.meshes.0.friction",
        ),
        (spoilt("request", "gravity", 2, value=float("nan")), "request.gravity.2"),
        (spoilt("request", "seed", value=0.5), "request.seed"),
        (spoilt("robot", "joint_names", value=None), "robot.joint_names"),
    ],
)
def test_the_first_field_at_fault_is_named(
    document: Document, tmp_path: Path, spoil: Callable[[Any], None], field: str
) -> None:
    spoil(document)
    with pytest.raises(InvalidInput) as caught:
        ContactPlan.read(write(tmp_path, document))
    assert caught.value.field == field


VERSION_1 = Path(__file__).parent / "data" / "version_1.plan.json"


def test_a_file_of_version_1_is_read_and_checked(tmp_path: Path) -> None:
    plan = ContactPlan.read(VERSION_1)
    assert plan.format == "rbprm-contact-plan/1"
    assert check_plan(plan).valid
    assert plan.request.bounds is plan.request.options is None
    assert (plan.robot.root_frame, plan.robot.description) == ("", None)
    assert all(node.joints == () for node in plan.guide)
    plan.write(tmp_path / "again.json")
    assert ContactPlan.read(tmp_path / "again.json") == plan


def test_version_2_holds_the_whole_request(plan: ContactPlan, outcomes: Outcomes) -> None:
    request, outcome = outcomes[0]
    entry = plan.request
    assert entry == request.entry()
    assert entry.options is not None
    assert entry.options["sequence"]["step"] == request.options.sequence.step
    assert (entry.stages.guide, entry.stages.contacts) == ("rrt", "along_guide")
    assert entry.required_limbs == request.required_limbs
    assert entry.start_limbs == request.start_limbs
    assert entry.bounds is not None
    assert entry.bounds.x == (request.bounds.low[0], request.bounds.high[0])
    assert plan.robot.root_frame == "base_link"
    assert plan.robot.description is not None
    assert len(plan.guide) == len(outcome.guide.nodes)


def test_joints_planned_with_the_root_are_kept(toy_data: RobotData) -> None:
    """The toy's waist is planned with its root."""
    robot = toy_data.robot
    entry = robot_entry(robot)
    assert entry.root_joints == ("waist",)
    assert entry.root_frame == "trunk"
