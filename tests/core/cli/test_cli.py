"""The command line: exit codes, and error texts with the field and its value.

Commands that plan, check or show a plan run in a process of their own. Invalid input, which has
many cases, is tested with the same `main` in this process, since importing the planner takes longer
than refusing a file.
"""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from rbprm_core.check import check_plan
from rbprm_core.cli.main import main
from rbprm_core.plan_record import ContactPlan
from rbprm_core.robot import known_robots
from rbprm_core.robot.data import RobotData
from rbprm_core.scenario import known_scenarios

VALID, INVALID, BAD, START, GOAL, NO_GUIDE, NO_SEQUENCE, TIME_LIMIT = range(8)
INTERRUPTED = 130

SCENARIO = """name = "mine"
robot = "{robot}"
[[environment.surfaces]]
id = "ground"
vertices = [[-2.0, -2.0, 0.0], [{edge}, -2.0, 0.0], [{edge}, 2.0, 0.0], [-2.0, 2.0, 0.0]]
[[environment.surfaces]]
id = "beyond"
vertices = [[4.0, -2.0, 0.0], [6.0, -2.0, 0.0], [6.0, 2.0, 0.0], [4.0, 2.0, 0.0]]
{bridge}
[request]
start = {{ position = [{start}, 0.0, {height}] }}
goal = {{ position = [{goal}, 0.0, {height}] }}
bounds = {{ x = [-3.0, 6.0], y = [-0.1, 0.1], z = [0.0, 3.0], yaw = 0.4, pitch = 0.2, roll = 0.2 }}
robustness_threshold = {threshold}
time_limit = 30.0
{more}
[options]
guides = 1
guide = {{ rrt = {{ iterations = 30 }} }}
"""

# A bridge for the left feet only: a guide with `required_limbs` LEFT crosses it, HyQ cannot.
BRIDGE = """[[environment.surfaces]]
id = "bridge"
vertices = [[1.0, 0.3, 0.0], [5.0, 0.3, 0.0], [5.0, 0.5, 0.0], [1.0, 0.5, 0.0]]"""
LEFT = 'required_limbs = ["lf_leg", "lh_leg"]'
UNHELD = {"goal": 5.0, "bridge": BRIDGE, "more": LEFT}

VERSION_1 = Path(__file__).parents[1] / "data" / "version_1.plan.json"

Run = Callable[..., subprocess.CompletedProcess[str]]
Refuse = Callable[..., str]


def scenario(folder: Path, **changes: Any) -> str:
    """A user's scenario file: HyQ over 40 cm of flat ground."""
    values = {"robot": "hyq", "edge": 2.0, "start": 0.0, "goal": 0.4, "height": 0.6}
    values |= {"threshold": 5.0, "bridge": "", "more": ""} | changes
    file = folder / "mine.toml"
    file.write_text(SCENARIO.format(**values))
    return str(file)


def command(*args: str) -> list[str]:
    return [sys.executable, "-m", "rbprm_core.cli.main", *args]


@pytest.fixture
def run(tmp_path: Path) -> Run:
    """Runs the command line in a process of its own, in an empty folder."""
    folder = tmp_path / "here"
    folder.mkdir()

    def start(*args: str) -> subprocess.CompletedProcess[str]:
        done = subprocess.run(
            command(*args), cwd=folder, capture_output=True, text=True, timeout=240, check=False
        )
        assert "Traceback" not in done.stderr
        return done

    return start


@pytest.fixture
def refuse(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Refuse:
    """Runs `main` in this process, checks its exit code and returns its errors."""

    def start(*args: str, code: int = BAD) -> str:
        monkeypatch.setattr(sys, "argv", ["rbprm", *args])
        with pytest.raises(SystemExit) as caught:
            main()
        assert caught.value.code == code
        out, err = capfd.readouterr()
        assert out == ""
        assert "Traceback" not in err
        return err

    return start


@pytest.fixture(scope="module")
def plan_file(
    tmp_path_factory: pytest.TempPathFactory, rubble_plans: dict[int, ContactPlan]
) -> Path:
    """A valid plan file: the first states, in a shorter request."""
    whole = rubble_plans[0]
    states = whole.states[:12]
    request = whole.request.model_copy(update={"goal": states[-1].root})
    file = tmp_path_factory.mktemp("plan") / "plan.json"
    whole.model_copy(update={"states": states, "request": request}).write(file)
    return file


def test_plan_and_check_a_users_scenario(run: Run, hyq_data: RobotData, tmp_path: Path) -> None:
    out = tmp_path / "plan.json"
    done = run("plan", scenario(tmp_path), "--seed", "4", "--out", str(out))
    assert (done.returncode, done.stderr) == (VALID, "")
    assert "independent check" in done.stdout
    assert "valid" in done.stdout
    assert f"written to {out}" in "".join(done.stdout.split("\n")).replace("  ", " ")
    found = ContactPlan.read(out)
    assert found.request.seed == 4
    assert found.environment.name == "mine"
    assert check_plan(found).valid
    checked = run("check", str(out))
    assert checked.returncode == VALID
    assert f"valid: {len(found.states)} states" in checked.stdout
    for figure in ("overhanging patches: 0", "contacts at the goal", "stable transitions: at both"):
        assert figure in checked.stdout


def test_a_plan_file_is_planned_again(
    run: Run, refuse: Refuse, hyq_data: RobotData, tmp_path: Path
) -> None:
    first, second, third = (str(tmp_path / f"{name}.json") for name in "abc")
    mine = scenario(tmp_path)
    assert run("plan", mine, "--seed", "4", "--out", first).returncode == VALID
    Path(mine).unlink()
    done = run("plan", first, "--out", second)
    assert (done.returncode, done.stderr) == (VALID, "")
    plans = [ContactPlan.read(file) for file in (first, second)]
    assert plans[0].states == plans[1].states
    assert plans[0].request == plans[1].request
    assert run("plan", first, "--seed", "5", "--out", third).returncode == VALID
    assert ContactPlan.read(third).request.seed == 5
    assert "robot = 'anymal': a plan is planned again" in refuse("plan", first, "--robot", "anymal")


def test_a_plan_of_version_1_is_checked_and_shown(run: Run, tmp_path: Path) -> None:
    assert run("check", str(VERSION_1)).returncode == VALID
    page = tmp_path / "plan.html"
    assert run("view", str(VERSION_1), "--out", str(page)).returncode == VALID
    assert "<html" in page.read_text()[:2000]


def test_a_plan_of_version_1_is_not_planned_again(refuse: Refuse) -> None:
    assert "robot.description = None: is missing" in refuse("plan", str(VERSION_1))
    assert "cannot be read" in refuse("plan", "absent.json")


def test_states_below_the_threshold_are_accepted_and_reported(
    run: Run, hyq_data: RobotData, tmp_path: Path
) -> None:
    """No state of HyQ reaches 300 N; without the flag the start is refused."""
    file = scenario(tmp_path, threshold=300.0)
    assert run("plan", file).returncode == START
    done = run("plan", file, "--accept-below-threshold")
    assert done.returncode == INVALID
    shown = " ".join(done.stdout.replace("│", " ").split())
    assert "threshold 300 N" in shown
    assert "states under it, by accept_below_threshold" in shown


def test_an_old_name_of_an_option_is_one_line_of_warning(refuse: Refuse) -> None:
    error = refuse("plan", "flat", "--seed", "-1", "--most-robust")
    assert error.splitlines()[0] == (
        "rbprm: warning: --most-robust is now called --accept-below-threshold; "
        "the old name will be refused in the next release"
    )


def test_a_users_robot(run: Run, toy_data: RobotData, toy_file: Path, tmp_path: Path) -> None:
    out = tmp_path / "toy.json"
    limits = {"robot": "hyq", "height": 0.42, "threshold": 2.0}
    done = run("plan", scenario(tmp_path, **limits), "--robot", str(toy_file), "--out", str(out))
    assert (done.returncode, done.stderr) == (VALID, "")
    assert ContactPlan.read(out).robot.name == "toy"


def test_several_jobs_name_the_seed_that_won(
    run: Run, toy_data: RobotData, toy_file: Path, tmp_path: Path
) -> None:
    mine = scenario(tmp_path, height=0.42, threshold=2.0, more='goal_limbs = ["lf", "rh"]')
    arguments = ("plan", mine, "--robot", str(toy_file), "--out")
    files = [tmp_path / name for name in ("won.json", "alone.json")]
    done = run(*arguments, str(files[0]), "--seed", "4", "--jobs", "2")
    assert (done.returncode, done.stderr) == (VALID, "")
    won = ContactPlan.read(files[0])
    assert won.request.seed in (4, 5)
    assert won.request.goal_limbs == ("lf", "rh")
    assert "contacts at the goal" in done.stdout
    done = run(*arguments, str(files[1]), "--seed", str(won.request.seed))
    assert (done.returncode, done.stderr) == (VALID, "")
    alone = ContactPlan.read(files[1])
    assert alone.states == won.states
    assert alone.guide == won.guide


def test_the_check_as_json(run: Run, plan_file: Path, tmp_path: Path) -> None:
    done = run("check", "--json", str(plan_file))
    assert (done.returncode, done.stderr) == (VALID, "")
    wanted = check_plan(ContactPlan.read(plan_file)).document()
    assert json.loads(done.stdout) == json.loads(json.dumps(wanted))
    text = json.loads(plan_file.read_text())
    text["states"][3]["joints"][0] = 9.0
    file = tmp_path / "bad.json"
    file.write_text(json.dumps(text))
    done = run("check", "--json", str(file))
    assert done.returncode == INVALID
    report = json.loads(done.stdout)
    assert report["valid"] is False
    assert {"joint-limit"} <= {violation["kind"] for violation in report["violations"]}


def test_a_spoilt_plan_is_invalid_with_one_line_a_violation(
    run: Run, plan_file: Path, tmp_path: Path
) -> None:
    text = json.loads(plan_file.read_text())
    text["states"][3]["joints"][0] = 9.0
    file = tmp_path / "bad.json"
    file.write_text(json.dumps(text))
    wanted = [str(violation) for violation in check_plan(ContactPlan.read(file)).violations]
    done = run("check", str(file))
    assert done.returncode == INVALID
    assert done.stdout.splitlines() == wanted
    assert len(wanted) > 1
    assert any(line.startswith("state 3") and "lf_haa_joint" in line for line in wanted)
    assert f"invalid: {len(wanted)} violations" in done.stderr


@pytest.mark.parametrize(
    ("changes", "code", "texts"),
    [
        ({"height": 2.5}, START, ["start is not reachable", "lf_leg"]),
        ({"height": 0.1}, START, ["start is not reachable", "trunk"]),
        ({"threshold": 1e4}, START, ["start is not reachable", "equilibrium"]),
        ({"goal": 3.0}, GOAL, ["goal is not reachable", "no support surface", "lf_leg"]),
        ({"goal": 5.0}, NO_GUIDE, ["no guide path found", "30 samples"]),
        (UNHELD, NO_SEQUENCE, ["no contact sequence found", "after state", "limb"]),
    ],
)
def test_every_way_to_fail_has_its_code(
    refuse_planning: Refuse, tmp_path: Path, changes: dict[str, Any], code: int, texts: list[str]
) -> None:
    error = refuse_planning("plan", scenario(tmp_path, **changes), code=code)
    assert error.startswith("rbprm: ")
    assert error.count("\n") == 1
    for text in texts:
        assert text in error


@pytest.fixture
def refuse_planning(
    hyq_data: RobotData, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> Refuse:
    """Like `refuse`, for errors after planning has begun and progress has been shown."""

    def start(*args: str, code: int) -> str:
        monkeypatch.setattr(sys, "argv", ["rbprm", *args])
        with pytest.raises(SystemExit) as caught:
            main()
        out, err = capfd.readouterr()
        assert caught.value.code == code, err
        assert "valid" not in out
        return err

    return start


@pytest.mark.parametrize(
    ("changes", "code"),
    [
        ({"robot": "unicorn"}, BAD),
        (UNHELD, NO_SEQUENCE),
    ],
)
def test_codes_reach_the_shell(
    run: Run, hyq_data: RobotData, tmp_path: Path, changes: dict[str, Any], code: int
) -> None:
    done = run("plan", scenario(tmp_path, **changes), "--out", str(tmp_path / "out.json"))
    assert done.returncode == code
    assert done.stderr.startswith("rbprm: ")
    assert not (tmp_path / "out.json").exists()


def test_the_time_limit_reaches_the_shell(run: Run, hyq_data: RobotData) -> None:
    done = run("plan", "rubble", "--time-limit", "0.05")
    assert done.returncode == TIME_LIMIT
    assert "time limit of 0.05 s reached in stage" in done.stderr


def test_an_interrupt_ends_it_at_once(hyq_data: RobotData, tmp_path: Path) -> None:
    """Ctrl-C during a search for a guide that does not exist."""
    file = Path(scenario(tmp_path, goal=5.0))
    file.write_text(file.read_text().replace("iterations = 30", "iterations = 100000000"))
    bars, errors_file = tmp_path / "bars", tmp_path / "errors"
    with bars.open("w") as out, errors_file.open("w") as err:
        process = subprocess.Popen(
            command("plan", str(file), "--time-limit", "300"),
            stdout=out,
            stderr=err,
            env={**os.environ, "TERM": "xterm", "FORCE_COLOR": "1", "COLUMNS": "200"},
        )
    try:
        end = time.monotonic() + 120
        while "guide" not in bars.read_text():
            assert process.poll() is None, errors_file.read_text()
            assert time.monotonic() < end, bars.read_text()
            time.sleep(0.05)
        process.send_signal(signal.SIGINT)
        assert process.wait(timeout=60) == INTERRUPTED
    finally:
        process.kill()
        process.wait(timeout=60)
    errors = errors_file.read_text()
    assert "interrupted" in errors
    assert "Traceback" not in errors


def test_view_writes_a_page_and_a_picture(run: Run, plan_file: Path, tmp_path: Path) -> None:
    page, picture = tmp_path / "plan.html", tmp_path / "plan.png"
    done = run("view", str(plan_file), "--out", str(page), "--picture", str(picture))
    assert (done.returncode, done.stderr) == (VALID, "")
    assert "<html" in page.read_text()[:2000]
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_listings(capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    for listing, known in (("scenarios", known_scenarios()), ("robots", known_robots())):
        monkeypatch.setattr(sys, "argv", ["rbprm", listing])
        with contextlib.suppress(SystemExit):
            main()
        lines = capfd.readouterr().out.splitlines()
        named = [line for line in lines if not line.startswith(" ")]
        assert [line.split()[0] for line in named] == sorted(known)
        if listing == "scenarios":
            what = [line.strip() for line in lines if line.startswith(" ")]
            assert len(what) == len(known)
            assert all(line[0].isupper() and line.endswith(".") for line in what)
            assert "quarters of HyQ's size." in "\n".join(what)  # from a comment of two lines


def test_help_names_every_command_and_code(
    capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "argv", ["rbprm", "--help"])
    with contextlib.suppress(SystemExit):
        main()
    text = capfd.readouterr().out
    for name in ("plan", "check", "view", "scenarios", "robots", "130 interrupted"):
        assert name in " ".join(text.split())  # wherever click ends the lines
    assert "..." not in text.partition("Commands:")[2]  # click cuts what does not fit


@pytest.mark.parametrize(
    "args",
    [
        ("walk",),
        ("plan",),
        ("plan", "flat", "--speed", "3"),
        ("plan", "flat", "--seed", "one"),
        ("plan", "flat", "--jobs", "0"),
        ("plan", "flat", "--time-limit", "soon"),
        ("plan", "flat", "--out", "."),
        ("check",),
    ],
)
def test_a_command_that_is_none(refuse: Refuse, args: tuple[str, ...]) -> None:
    assert "Error" in refuse(*args)


@pytest.mark.parametrize(
    ("args", "texts"),
    [
        (("plan", "moon"), ["scenario = 'moon'", "flat, ", "rubble"]),
        (("plan", "/no/such.toml"), ["scenario = '/no/such.toml'"]),
        (("plan", "flat", "--robot", "unicorn"), ["robot = 'unicorn'", "anymal, ", "hyq"]),
        (("plan", "flat", "--robot", "/no/such.toml"), ["robot = '/no/such.toml'"]),
        (("plan", "flat", "--seed", "-1"), ["seed = -1", "negative"]),
        (("plan", "flat", "--time-limit", "-3"), ["time_limit = -3.0"]),
        (("plan", "flat", "--time-limit", "0"), ["time_limit = 0.0"]),
        (("plan", "flat", "--time-limit", "nan"), ["time_limit = nan", "finite"]),
        (("plan", "flat", "--time-limit", "inf"), ["time_limit = inf", "finite"]),
        (("plan", "flat", "--robustness", "nan"), ["robustness_threshold = nan", "finite"]),
        (("plan", "flat", "--out", "/no/such/plan.json"), ["out = '/no/such/plan.json'"]),
        (("check", "/no/such.json"), ["plan = '/no/such.json'", "cannot be read"]),
        (("view", "/no/such.json"), ["plan = '/no/such.json'", "cannot be read"]),
    ],
)
def test_a_bad_argument_is_named_with_its_value(
    refuse: Refuse, args: tuple[str, ...], texts: list[str]
) -> None:
    error = refuse(*args)
    assert error.startswith("rbprm: ")
    for text in texts:
        assert text in error


@pytest.mark.parametrize(
    ("old", "new", "texts"),
    [
        ("[0.4, 0.0, 0.6]", "[nan, 0.0, 0.6]", ["scenario.request.goal.position.0 = nan"]),
        ("[0.4, 0.0, 0.6]", "[0.4, inf, 0.6]", ["scenario.request.goal.position.1 = inf"]),
        (
            "position = [0.4, 0.0, 0.6]",
            "position = [0.4, 0.0, 0.6], orientation = [0, 0, 0, 0]",
            ["request.goal.orientation", "norm is 0"],
        ),
        (
            "position = [0.4, 0.0, 0.6]",
            "position = [0.4, 0.0, 0.6], orientation = [0, 0, 1, 1]",
            ["request.goal.orientation", "unit quaternion"],
        ),
        ("[-2.0, 2.0, 0.0]]", "[-2.0, 2.0, 0.5]]", ["surfaces.0.vertices", "not planar"]),
        ("[-2.0, 2.0, 0.0]]", "[3.0, 0.0, 0.0]]", ["surfaces.0.vertices", "simple"]),
        (", [2.0, 2.0, 0.0], [-2.0, 2.0, 0.0]]", "]", ["surfaces.0.vertices", "three distinct"]),
        (
            "[2.0, 2.0, 0.0], [-2.0, 2.0, 0.0]]",
            "[0.0, -2.0, 0.0]]",
            ["surfaces.0.vertices", "no area"],
        ),
        ('id = "ground"', 'id = "ground"\nfriction = -0.5', ["surfaces.0.friction = -0.5"]),
        ('id = "beyond"', 'id = "ground"', ["surfaces = 'ground'", "this id"]),
        ("time_limit = 30.0", "time_limit = -30.0", ["request.time_limit = -30.0"]),
        ("yaw = 0.4", "yaw = nan", ["request.bounds.yaw = nan"]),
        ("x = [-3.0, 6.0]", "x = [6.0, -3.0]", ["request.bounds.x = [6.0, -3.0]", "empty"]),
        ("time_limit = 30.0", 'start_limbs = ["tail"]', ["start_limbs.0 = 'tail'", "lf_leg"]),
        (
            "time_limit = 30.0",
            'required_limbs = ["tail"]',
            ["request.required_limbs.0 = 'tail'", "lf_leg"],
        ),
        ("time_limit = 30.0", 'goal_limbs = ["tail"]', ["request.goal_limbs.0 = 'tail'", "lf_leg"]),
        ("[options]", "[heuristics]\ntail = { effort = 1 }\n[options]", ["heuristics = 'tail'"]),
        (
            "[options]",
            "[heuristics]\nlf_leg = { luck = 1 }\n[options]",
            ["heuristics.lf_leg = 'luck'", "velocity"],
        ),
        (
            "[options]",
            "[heuristics]\nlf_leg = { effort = nan }\n[options]",
            ["heuristics.lf_leg.effort = nan"],
        ),
        ("guides = 1", "gait = 2", ["options.gait = 2", "Unexpected"]),
        ('robot = "hyq"', 'robot = "unicorn"', ["robot = 'unicorn'"]),
        ('name = "mine"', "name = ", ["scenario", "TOML"]),
    ],
)
def test_a_bad_scenario_is_named_by_field_and_value(
    refuse: Refuse, tmp_path: Path, old: str, new: str, texts: list[str]
) -> None:
    file = Path(scenario(tmp_path))
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new, 1))
    error = refuse("plan", str(file))
    for wanted in texts:
        assert wanted in error


@pytest.mark.parametrize("environment", ["", '[[environment.meshes]]\nfile = "no/such.stl"\n'])
def test_a_bad_environment(refuse: Refuse, tmp_path: Path, environment: str) -> None:
    file = Path(scenario(tmp_path))
    head, tail = file.read_text().split("[[environment.surfaces]]", 1)
    request = tail[tail.index("[request]") :]
    file.write_text(head + (environment or "[environment]\n") + request)
    error = refuse("plan", str(file))
    assert ("environment.meshes.0.file = 'no/such.stl'" if environment else "environment") in error


def test_a_truncated_mesh(refuse: Refuse, tmp_path: Path) -> None:
    mesh = tmp_path / "half.stl"
    mesh.write_bytes(b"\0" * 80 + (1000).to_bytes(4, "little") + b"\0" * 500)
    file = Path(scenario(tmp_path))
    head, tail = file.read_text().split("[[environment.surfaces]]", 1)
    place = f'[[environment.meshes]]\nfile = "{mesh}"\n'
    file.write_text(head + place + tail[tail.index("[request]") :])
    error = refuse("plan", str(file))
    assert f"environment.meshes.0.file = '{mesh}'" in error


@pytest.mark.parametrize(
    ("old", "new", "texts"),
    [
        ("lf_haa_joint", "knee", ["limbs.lf_leg.first_joint = 'knee'", "rf_haa_joint"]),
        ('"lf_foot"', '"toe"', ["limbs.lf_leg.effector = 'toe'", "unknown frame"]),
        ("radius = 0.02175 }", "radius = nan }", ["robot.limbs.0.contact", "radius = nan"]),
        ("trunk_scale = 1.1", "trunk_scale = 0.1", ["robot.volumes.trunk_scale = 0.1"]),
        ("hyq_no_sensors.urdf", "no.urdf", ["robot.urdf", "no.urdf", "no such file"]),
        ('name = "hyq"', 'name = "hyq"\ncolour = 1', ["robot.colour = 1"]),
    ],
)
def test_a_bad_robot_is_named_by_field_and_value(
    refuse: Refuse, tmp_path: Path, old: str, new: str, texts: list[str]
) -> None:
    text = known_robots()["hyq"].read_text()
    assert old in text
    file = tmp_path / "robot.toml"
    file.write_text(text.replace(old, new, 1))
    error = refuse("plan", scenario(tmp_path), "--robot", str(file))
    for wanted in texts:
        assert wanted in error


def test_an_unknown_heuristic(
    refuse_planning: Refuse, toy_file: Path, toy_data: RobotData, tmp_path: Path
) -> None:
    file = tmp_path / "lucky.toml"
    text = toy_file.read_text()
    file.write_text(text.replace("samples = 3000", "samples = 3000\nheuristics = { luck = 1 }", 1))
    error = refuse_planning("plan", scenario(tmp_path, height=0.42), "--robot", str(file), code=BAD)
    assert "limbs.lf.heuristics = 'luck'" in error
    assert "manipulability" in error


@pytest.mark.parametrize("which", ["check", "view"])
@pytest.mark.parametrize(
    ("content", "texts"),
    [
        ("", ["plan", "JSON"]),
        ("solid mesh", ["plan", "JSON"]),
        ("[1, 2]", ["format", "plan file"]),
        ('{"format": "another/1"}', ["format = 'another/1'"]),
        ('{"format": "rbprm-contact-plan/1"}', ["robot", "required"]),
    ],
)
def test_a_file_that_is_no_plan(
    refuse: Refuse, tmp_path: Path, which: str, content: str, texts: list[str]
) -> None:
    file = tmp_path / "plan.json"
    file.write_text(content)
    error = refuse(which, str(file))
    for text in texts:
        assert text in error


@pytest.mark.parametrize("which", ["check", "view"])
def test_a_plan_with_nan_in_it(refuse: Refuse, plan_file: Path, tmp_path: Path, which: str) -> None:
    text = json.loads(plan_file.read_text())
    text["states"][1]["joints"][2] = float("nan")
    file = tmp_path / "nan.json"
    file.write_text(json.dumps(text))
    assert "states.1.joints.2 = nan" in refuse(which, str(file))
