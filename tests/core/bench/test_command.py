"""`rbprm bench` and `rbprm bench-scaling`: their output, files and errors."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from rbprm_core.bench import Campaign, RunRecord, campaign, scaling
from rbprm_core.bench.record import Task
from rbprm_core.cli.main import main

MakeRecord = Callable[..., RunRecord]

DONE, BAD, INTERRUPTED = 0, 2, 130
FILES = {"campaign.json", "campaign.md", "time_to_solution.png", "success_over_time.png"}

Run = Callable[..., tuple[str, str]]


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    """Runs `main` in this process, checks its exit code and returns its output and errors."""

    def start(*arguments: str, code: int = DONE) -> tuple[str, str]:
        monkeypatch.setattr(sys, "argv", ["rbprm", *arguments])
        with pytest.raises(SystemExit) as caught:
            main()
        found = capsys.readouterr()
        assert (caught.value.code or DONE) == code, found.err
        return found.out, found.err

    return start


def test_an_interrupted_campaign_is_kept_and_resumed(
    run: Run, stroll: str, quick_hyq: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real, done = campaign.run_task, []

    def interrupted_at_last(task: Task) -> RunRecord:
        if task.seed == 8:
            raise KeyboardInterrupt
        done.append(task.seed)
        return real(task)

    command = ["bench", stroll, "--robot", quick_hyq, "--first-seed", "7", "--seeds", "2"]
    command += ["--out", str(tmp_path)]
    monkeypatch.setattr(campaign, "run_task", interrupted_at_last)
    output, _ = run(*command, code=INTERRUPTED)
    assert "1 of 2 runs" in output
    assert {path.name for path in tmp_path.iterdir()} == FILES
    stopped = Campaign.read(tmp_path / "campaign.json")
    assert (stopped.stopped, stopped.requested) == ("interrupted", 2)

    monkeypatch.setattr(campaign, "run_task", real)
    output, _ = run(*command, "--resume")
    assert "2 of 2 succeeded" in output
    whole = Campaign.read(tmp_path / "campaign.json")
    assert whole.stopped == ""
    assert whole.records[0] == stopped.records[0]
    assert [record.seed for record in whole.records] == [7, 8]


def test_growth_is_printed_and_written(
    run: Run, make_record: MakeRecord, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Only the output of the command is tested here, so the runs are replaced by records.
    monkeypatch.setattr(scaling, "_run", lambda *_: make_record())
    monkeypatch.setattr(scaling, "load_robot_data", lambda *_: None)
    output, _ = run(
        "bench-scaling", "length", "--sizes", "1,2", "--seeds", "1", "--out", str(tmp_path)
    )
    assert "| exponent |" in output
    assert {path.suffix for path in tmp_path.iterdir()} == {".json", ".md", ".png"}


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (("bench", "nowhere"), "scenario = 'nowhere'"),
        (("bench", "flat", "--seeds", "0"), "seeds = 0"),
        (("bench", "flat", "--first-seed", "-1"), "seeds = [-1"),
        (("bench", "flat", "--robustness", "-2"), "robustness_threshold = -2.0"),
        (("bench", "flat", "--time-limit", "0"), "time_limit = 0.0"),
        (("bench", "flat", "--jobs", "0"), "jobs = 0"),
        (("bench", "flat", "--scheduler", "tcp://x:1"), "scheduler = 'tcp://x:1'"),
        (("bench", "flat", "--resume"), "campaign = "),
        (("bench", "flat", "--out", "/dev/null/x"), "out = '/dev/null/x'"),
        (("bench-scaling", "--sizes", "1,x"), "sizes = '1,x'"),
        (("bench-scaling", "--sizes", "3"), "sizes = [3]"),
        (("bench-scaling", "--seeds", "0"), "seeds = 0"),
    ],
)
def test_a_bad_argument_is_named(
    run: Run, tmp_path: Path, arguments: tuple[str, ...], text: str
) -> None:
    more = () if "--out" in arguments else ("--out", str(tmp_path))
    _, errors = run(*arguments, *more, code=BAD)
    assert text in " ".join(errors.split())
