"""Contact planners by name, those of other packages included."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rbprm_core.budget import Budget
from rbprm_core.contacts.registry import CONTACT_PLANNERS
from rbprm_core.errors import InvalidInput
from rbprm_core.planner import plan
from rbprm_core.robot.data import RobotData
from rbprm_core.scenario import load_scenario

EXAMPLE = Path(__file__).parents[3] / "examples" / "contact_planner_plugin"


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """The example, installed as pip leaves it: its module, and the metadata of its package."""
    project = tomllib.loads((EXAMPLE / "pyproject.toml").read_text())["project"]
    (tmp_path / "short_steps.py").write_text((EXAMPLE / "short_steps.py").read_text())
    info = tmp_path / "short_steps-0.1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: short-steps\nVersion: 0.1.0\n")
    points = project["entry-points"][CONTACT_PLANNERS.group]
    lines = [f"{name} = {value}" for name, value in points.items()]
    text = "\n".join([f"[{CONTACT_PLANNERS.group}]", *lines])
    (info / "entry_points.txt").write_text(text)
    monkeypatch.syspath_prepend(str(tmp_path))
    CONTACT_PLANNERS.clear()
    yield "short_steps"
    CONTACT_PLANNERS.clear()


def test_an_unknown_contact_planner_is_refused() -> None:
    with pytest.raises(InvalidInput, match="unknown contact planner; known: along_guide") as caught:
        CONTACT_PLANNERS.get("by_magic", "stages.contacts")
    assert (caught.value.field, caught.value.value) == ("stages.contacts", "by_magic")


def test_the_example_plans_with_half_the_step(installed: str, hyq_data: RobotData) -> None:
    assert CONTACT_PLANNERS.names() == ("along_guide", installed)
    scenario = load_scenario("flat")
    request, scene = scenario.request_for(hyq_data.robot), scenario.scene()
    stages = replace(request.stages, contacts=installed)
    plain = plan(request, hyq_data, scene, Budget(60.0))
    short = plan(replace(request, stages=stages), hyq_data, scene, Budget(60.0))
    assert short.statistics.versions["short-steps"] == "0.1.0"
    longest = [
        max(np.linalg.norm(np.diff([s.q[:3] for s in found.states], axis=0), axis=1))
        for found in (plain, short)
    ]
    assert longest[1] < 0.6 * longest[0]
