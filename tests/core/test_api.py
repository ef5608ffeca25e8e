"""The library for users: what its page shows works, and what it refuses is named."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
import trimesh

import rbprm_core as rbprm
from rbprm_core.budget import Progress
from rbprm_core.planning_input import input_from_plan
from rbprm_core.robot.data import RobotData
from rbprm_core.scene import make_surface

PAGE = Path(__file__).resolve().parents[2] / "docs" / "python.md"
SNIPPETS = re.findall(r"^```python\n(.*?)^```$", PAGE.read_text(), re.DOTALL | re.MULTILINE)
FLOOR = [(-4, -2, 0), (4, -2, 0), (4, 2, 0), (-4, 2, 0)]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder, with a mesh of a floor: a box whose top is at z = 0."""
    floor = trimesh.creation.box((10.0, 4.0, 0.2))
    floor.apply_translation((0.5, 0.0, -0.1))
    floor.export(tmp_path / "terrain.stl")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_first_snippet_of_the_page(folder: Path, hyq_data: RobotData) -> None:
    names: dict[str, Any] = {}
    exec(SNIPPETS[0], names)
    plan = names["plan"]
    assert plan.check().valid
    assert plan.configurations().shape == (len(plan.states), 19)
    assert plan.configurations()[0, :3].tolist() == [-2, 0, 0.63]
    assert plan.configurations()[-1, :3].tolist() == [3, 0, 0.63]
    assert plan.guide.shape[1] == 7
    assert plan.statistics.counts["states"] == len(plan.states)
    assert repr(plan) == f"<Plan of hyq in {len(plan.states)} states>"
    again = rbprm.Plan.load(folder / "a.plan.json")
    assert again.record.model_dump() == plan.record.model_dump()
    assert "<html" in (folder / "a.html").read_text()[:2000]
    (mesh,) = plan.record.environment.meshes
    assert mesh.file == str(folder / "terrain.stl")


def test_the_other_snippets_of_the_page(hyq_data: RobotData) -> None:
    names: dict[str, Any] = {"rbprm": rbprm}
    for snippet in SNIPPETS[1:]:
        exec(snippet, names)
    assert [limb.name for limb in names["robot"].limbs] == ["left_leg", "right_leg"]
    scene = names["scene"]
    assert list(scene.index) == ["ground", "step"]
    plan = rbprm.plan("hyq", scene, (-0.5, 0, 0.63), (1.2, 0, 0.73), robustness_threshold=10.0)
    assert plan.check().valid
    assert min(state.robustness for state in plan.states) >= 10.0


def test_the_forms_of_a_pose_and_of_options(hyq: rbprm.Robot, hyq_data: RobotData) -> None:
    scene = rbprm.Scene.from_polygons([FLOOR])
    turned = rbprm.Placement.parse((0.3, 0, 0.6), (0, 0, np.sin(0.1), np.cos(0.1)))
    goals = (turned, turned.transform, [*turned.position, *turned.orientation])
    seen: list[Progress] = []
    plans = [
        rbprm.plan(
            hyq, scene, (0, 0, 0.6), goal, options={"sequence": {"step": 0.05}}, report=seen.append
        )
        for goal in goals
    ]
    assert seen
    for plan in plans:
        assert np.allclose(plan.configurations(), plans[0].configurations())
        assert plan.record.request.options is not None
        assert plan.record.request.options["sequence"]["step"] == 0.05
    given = input_from_plan(plans[2].record)  # planned again from its file
    assert given.request.bounds.half_ranges.tolist() == [0.4, 0.3, 0.3]
    assert given.request.start_limbs == ("lf_leg", "rf_leg", "lh_leg", "rh_leg")


def test_an_edited_scene_is_kept_as_polygons(hyq: rbprm.Robot, hyq_data: RobotData) -> None:
    block = [(1, -1, 0.1), (2, -1, 0.1), (2, 1, 0.1), (1, 1, 0.1)]
    scene = rbprm.Scene.from_polygons([FLOOR]).edited([make_surface("block", block, 0.7)])
    assert [entry.id for entry in scene.environment.surfaces] == ["surface_0", "block"]
    plan = rbprm.plan(hyq, scene, (0, 0, 0.6), (0.2, 0, 0.6))
    assert len(plan.record.environment.surfaces) == 2


@pytest.mark.parametrize(
    ("arguments", "field"),
    [
        ({"start": (0, 0)}, "start"),
        ({"start": "here"}, "start"),
        ({"goal": (0, 0, float("nan"))}, "goal.position"),
        ({"goal": (0, 0, 0.6, 0, 0, 0, 2)}, "goal.orientation"),
        ({"seed": -1}, "seed"),
        ({"time_limit": 0.0}, "time_limit"),
        ({"robustness_threshold": -1.0}, "robustness_threshold"),
        ({"start_limbs": ["tail"]}, "start_limbs.0"),
        ({"gravity": (0, 0)}, "gravity.2"),
        ({"guide": "astar"}, "stages.guide"),
        ({"contacts": "astar"}, "stages.contacts"),
        ({"options": {"sequence": {"steps": 1}}}, "options.sequence.steps"),
        ({"bounds": rbprm.RootBounds(np.zeros(3), np.ones(3), np.full(3, 0.1))}, "start"),
    ],
)
def test_the_argument_at_fault_is_named(
    hyq: rbprm.Robot, hyq_data: RobotData, arguments: dict[str, Any], field: str
) -> None:
    scene = rbprm.Scene.from_polygons([FLOOR])
    given = {"start": (-1.0, 0, 0.6), "goal": (0.4, 0, 0.6), **arguments}
    with pytest.raises(rbprm.InvalidInput) as caught:
        rbprm.plan(hyq, scene, **given)
    assert caught.value.field == field


@pytest.mark.parametrize(
    ("make", "field"),
    [
        (lambda: rbprm.load_robot("unicorn"), "robot"),
        (lambda: rbprm.load_robot("hyq", limbs=["tail"]), "limbs"),
        (lambda: rbprm.Scene.from_mesh("absent.stl"), "file"),
        (lambda: rbprm.Scene.from_polygons([[(0, 0, 0)]]), "polygons.surface_0"),
        (lambda: rbprm.Scene.from_polygons({"a": FLOOR}, friction=-1), "friction"),
        (lambda: rbprm.Scene.from_polygons({"a": [(0, 0)]}), "polygons.a"),
        (lambda: rbprm.Scene.from_mesh("a.stl", friction=-1.0), "friction"),
        (lambda: rbprm.Plan.load("absent.json"), "plan"),
    ],
)
def test_files_and_shapes_at_fault(make: Any, field: str) -> None:
    with pytest.raises(rbprm.InvalidInput) as caught:
        make()
    assert caught.value.field == field


def test_a_goal_out_of_reach_is_an_error_of_its_own(hyq: rbprm.Robot, hyq_data: RobotData) -> None:
    scene = rbprm.Scene.from_polygons([FLOOR])
    with pytest.raises(rbprm.GoalUnreachable) as caught:
        rbprm.plan(hyq, scene, (0, 0, 0.6), (4.9, 0, 0.6))
    assert isinstance(caught.value, rbprm.RbprmError)


def test_every_public_name_is_there() -> None:
    for name in rbprm.__all__:
        assert getattr(rbprm, name) is not None
        assert name in dir(rbprm)
    assert re.fullmatch(r"\d+\.\d+\.\d+", rbprm.__version__)
    assert pin.SE3 is not None
    with pytest.raises(AttributeError, match="no attribute 'walk'"):
        _ = rbprm.walk  # type: ignore[attr-defined]


def test_importing_the_package_loads_nothing_else() -> None:
    code = (
        "import sys, rbprm_core; "
        "print(*(name for name in ('numpy', 'pinocchio', 'pydantic') if name in sys.modules)), "
        "print(*(name for name in sys.modules if name.startswith('rbprm_core')))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60
    )
    assert done.stdout.split() == ["rbprm_core"], done.stdout
