"""The command `rbprm posture` on a plan over the rubble."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from rbprm_core.check import check_plan
from rbprm_core.cli.main import main
from rbprm_core.plan_record import ContactPlan
from rbprm_core.robot.data import RobotData

Posture = Callable[..., tuple[int, str]]


@pytest.fixture(scope="module")
def plan_file(
    rubble_plans: dict[int, ContactPlan], tmp_path_factory: pytest.TempPathFactory
) -> Path:
    """A plan over the rubble."""
    file = tmp_path_factory.mktemp("posture") / "rubble.plan.json"
    rubble_plans[0].write(file)
    return file


@pytest.fixture
def posture(
    plan_file: Path,
    hyq_data: RobotData,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> Posture:
    """Runs the command on the plan; exit code, and output with errors."""

    def run(*arguments: str, file: Path = plan_file) -> tuple[int, str]:
        monkeypatch.setattr(sys, "argv", ["rbprm", "posture", str(file), *arguments])
        with pytest.raises(SystemExit) as stopped:
            main()
        output = capfd.readouterr()
        code = stopped.value.code
        return (int(code) if code is not None else 0), output.out + output.err

    return run


def moving(plan: ContactPlan) -> int:
    """Index of the first transition that moves a contact."""
    return next(k for k, t in enumerate(plan.transitions) if t.action == "move")


def test_a_witness_is_found_and_described(
    posture: Posture, rubble_plans: dict[int, ContactPlan]
) -> None:
    index = moving(rubble_plans[0])
    limb = rubble_plans[0].transitions[index].limb
    code, output = posture("--transition", str(index))
    assert code == 0
    assert f"witness of transition {index} at lift-off: found" in output
    robustness = next(line for line in output.splitlines() if line.startswith("robustness"))
    assert limb not in robustness
    for figure in ("contacts:", "torque ratio:", "joint limits:", "clearance:", "root of hyq"):
        assert figure in output


def test_a_posture_is_written_as_a_plan_and_shown(posture: Posture, tmp_path: Path) -> None:
    out, page, picture = (tmp_path / name for name in ("a.json", "a.html", "a.png"))
    code, output = posture(
        "--state", "4", "--upright", "trunk", "--max-torque-ratio", "1.0",
        "--out", str(out), "--page", str(page), "--picture", str(picture),
    )  # fmt: skip
    assert code == 0, output
    plan = ContactPlan.read(out)
    assert len(plan.states) == 1
    report = check_plan(plan)
    assert report.valid, [str(violation) for violation in report.violations]
    assert page.stat().st_size > 1000
    assert picture.stat().st_size > 1000


def test_what_cannot_be_met_is_named(posture: Posture) -> None:
    code, output = posture("--state", "4", "--min-robustness", "2000")
    assert code == 1
    assert "posture of state 4: not found: robustness" in output
    assert "under 2e+03 N" in output or "under 2000 N" in output


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((), "give either a state or a transition"),
        (("--state", "1", "--transition", "1"), "give either a state or a transition"),
        (("--state", "999"), "must lie in"),
        (("--transition", "-1"), "must lie in"),
        (("--state", "1", "--upright", "tail"), "no frame of the robot"),
        (("--state", "1", "--max-torque-ratio", "0"), "max_torque_ratio"),
    ],
)
def test_wrong_input_is_refused(posture: Posture, arguments: tuple[str, ...], message: str) -> None:
    code, output = posture(*arguments)
    assert code == 2
    assert message in output
