"""The calibration of the trunk's scale: its counts agree with the condition and the search."""

from __future__ import annotations

import io
import json
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from rbprm_core.calibration import SCALES, ScaleCounts, calibrate
from rbprm_core.cli.calibrate import _table
from rbprm_core.cli.main import main
from rbprm_core.errors import InvalidInput
from rbprm_core.guide.root import RootBounds
from rbprm_core.robot.data import RobotData
from rbprm_core.scenario import Scenario
from rbprm_core.scene import Scene, make_surface

COMMAND = [sys.executable, "-m", "rbprm_core.cli.main", "calibrate"]


@pytest.fixture(scope="module")
def counted(hyq_data: RobotData, rubble: Scenario, rubble_scene: Scene) -> list[ScaleCounts]:
    request = rubble.request_for(hyq_data.robot, 0)
    return calibrate(request, hyq_data, rubble_scene, 25, 0)


def test_every_sample_is_counted_once_a_scale(counted: list[ScaleCounts]) -> None:
    assert [row.scale for row in counted] == list(SCALES)
    assert {row.samples for row in counted} == {25}
    for row in counted:
        assert row.false_positive_rate == row.false_positives / 25
        assert row.false_negative_rate == row.false_negatives / 25


def test_the_table_has_the_shares() -> None:
    console = Console(file=io.StringIO(), width=100)
    with console.capture() as shown:
        console.print(_table("hyq", [ScaleCounts(1.1, 5, 1, 2, 12)], own=1.1))
    assert re.findall(r"[\d.]+%", shown.get()) == ["5.0%", "10.0%", "30.0%", "35.0%"]


def test_a_bigger_trunk_refuses_more(counted: list[ScaleCounts]) -> None:
    """The number of contact configurations does not depend on the scale."""
    holds = [row.true_positives + row.false_positives for row in counted]
    assert holds == sorted(holds, reverse=True)
    assert holds[0] > holds[-1]
    assert len({row.true_positives + row.false_negatives for row in counted}) == 1
    misses = [row.false_negatives for row in counted]
    assert misses == sorted(misses)


def test_the_seed_decides(hyq_data: RobotData, rubble: Scenario, rubble_scene: Scene) -> None:
    request = rubble.request_for(hyq_data.robot, 0)
    runs = [
        calibrate(request, hyq_data, rubble_scene, 8, seed, scales=(1.0, 1.5)) for seed in (4, 4, 5)
    ]
    assert runs[0] == runs[1]
    assert runs[0] != runs[2]


def test_the_condition_is_right_on_flat_ground(
    hyq_data: RobotData, rubble: Scenario, flat_scene: Scene
) -> None:
    """At the heights of a standing HyQ, the condition holds and contact configurations exist."""
    low, high = np.array([-2.0, -2, 0.55]), np.array([2.0, 2, 0.65])
    bounds = RootBounds(low, high, np.array([3.0, 0.05, 0.05]))
    request = replace(rubble.request_for(hyq_data.robot, 0), bounds=bounds)
    reported: list[int] = []
    (row,) = calibrate(request, hyq_data, flat_scene, 12, 0, scales=(1.1,), report=reported.append)
    assert row.true_positives == 12
    assert reported == list(range(1, 13))


def test_bounds_without_surfaces_are_bad_input(hyq_data: RobotData, rubble: Scenario) -> None:
    far = Scene([make_surface("f", [[50, 0, 0], [51, 0, 0], [51, 1, 0], [50, 1, 0]], 0.5)])
    request = rubble.request_for(hyq_data.robot, 0)
    with pytest.raises(InvalidInput, match="contain no root"):
        calibrate(request, hyq_data, far, 1, 0)


def test_the_command_prints_the_table_and_writes_the_counts(
    hyq_data: RobotData, tmp_path: Path
) -> None:
    file = tmp_path / "counts.json"
    run = subprocess.run(
        [*COMMAND, "hyq", "flat", "rubble", "--samples", "3", "--json", str(file)],
        capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip
    assert run.returncode == 0, run.stderr
    for text in ("hyq: flat", "hyq: rubble", "hyq: all scenarios", "false positive", "1.15"):
        assert text in run.stdout
    found = json.loads(file.read_text())
    assert found["robot"] == "hyq"
    assert found["samples"] == 3
    rows = found["scenarios"]["rubble"]
    assert [row["scale"] for row in rows] == list(SCALES)
    assert all(sum(v for k, v in row.items() if k != "scale") == 3 for row in rows)


@pytest.mark.parametrize(
    ("args", "text"),
    [
        (["hyq", "rubble", "--samples", "0"], "samples = 0: must be at least 1"),
        (["hyq", "rubble", "--seed", "-1"], "seed = -1: must be at least 0"),
        (["hyq", "rubble", "--json", "/no/such/folder/x.json"], "its folder does not exist"),
        (["wing", "rubble"], "wing"),
        (["hyq", "hill"], "hill"),
    ],
)
def test_bad_arguments_are_named(
    args: list[str], text: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["rbprm", "calibrate", *args])
    with pytest.raises(SystemExit) as caught:
        main()
    assert caught.value.code == 2
    assert text in capsys.readouterr().err
