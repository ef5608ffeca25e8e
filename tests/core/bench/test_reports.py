"""Tables and plots of campaigns made by hand."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from rbprm_core.bench import Campaign, RunRecord, write_campaign
from rbprm_core.bench.machine import this_machine
from rbprm_core.bench.record import RunFailure
from rbprm_core.bench.tables import markdown, table
from rbprm_core.errors import InvalidInput

MakeRecord = Callable[..., RunRecord]

FAILED = ("NO_SEQUENCE", "no_equilibrium", "lf_leg", "either / or")
PNG = b"\x89PNG\r\n\x1a\n"


@pytest.fixture
def campaign(make_record: MakeRecord) -> Campaign:
    """One success, one failure, and a scenario without published figures."""
    failure = RunFailure("NO_SEQUENCE", "no_equilibrium", "lf_leg", "either | or")
    operations = {"sequence.statics": 0.1, "sequence.collision": 0.2}
    first = make_record()
    records = (
        make_record(seconds=first.seconds | operations, support=(3, 1, 0)),
        make_record(seed=1, failure=failure, states=0, transitions=0),
        make_record(scenario="mine", failure=failure),
    )
    return Campaign(this_machine(), "loky", 1, 4, records, "interrupted")


def rows(text: str, heading: str) -> list[list[str]]:
    """Cells of the table under a heading."""
    part = text.split(f"## {heading}\n", 1)[1].split("\n## ", 1)[0]
    lines = [line for line in part.splitlines() if line.startswith("|")]
    return [line.replace("\\|", "/").strip("| ").split(" | ") for line in lines]


def test_published_figures_follow_each_case(campaign: Campaign) -> None:
    found = rows(markdown(campaign), "Times, as in table 2 of Tonneau et al. 2018")
    head, _, ours, paper, other = found
    assert ours[head.index("collision")] == "200 – 200 – 200"
    assert ours[head.index("guide")] == "300 – 300 – 300"
    assert paper[head.index("robot")] == "Tonneau et al. 2018, HyQ"
    assert paper[head.index("total")] == "1548 – 18058 – 13126"
    assert other[head.index("total")] == "–"
    success = rows(markdown(campaign), "Success, as in table 3 of Tonneau et al. 2018")
    assert [row[2] for row in success[2:]] == ["50.0 %", "74.0 %", "0.0 %"]


def test_every_row_has_every_cell(campaign: Campaign) -> None:
    text = markdown(campaign)
    for heading in ("Overview", "Phases", "Failures", "Measures of the check"):
        assert len({len(row) for row in rows(text, heading)}) == 1
    assert "3 of 4 runs (stopped: interrupted)" in text


def test_failures_are_named(campaign: Campaign) -> None:
    first = rows(markdown(campaign), "Failures")[2]
    assert first == ["`rubble`", "hyq", "1 of 2", *FAILED, "1"]


def test_a_cell_cannot_break_the_table() -> None:
    assert table(["a"], [["x|y\nz"]]).splitlines()[-1] == "| x\\|y z |"


def test_a_campaign_is_written_and_read_back(campaign: Campaign, tmp_path: Path) -> None:
    folder = tmp_path / "new" / "folder"
    data, tables, *plots = write_campaign(campaign, folder)
    assert Campaign.read(data) == campaign
    assert tables.read_text() == markdown(campaign)
    assert len(plots) == 2
    assert all(plot.read_bytes().startswith(PNG) for plot in plots)


def test_an_empty_campaign_leaves_no_plots(tmp_path: Path) -> None:
    empty = Campaign(this_machine(), "loky", 1, 4, (), "interrupted")
    assert [path.name for path in write_campaign(empty, tmp_path)] == [
        "campaign.json",
        "campaign.md",
    ]


def test_a_folder_that_cannot_be_written(campaign: Campaign, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InvalidInput) as caught:
        write_campaign(campaign, tmp_path / "file")
    assert caught.value.field == "out"


@pytest.mark.parametrize(
    ("content", "field"), [("", "campaign"), ("{}", "machine"), ('{"jobs": "x"}', "machine")]
)
def test_a_file_that_is_no_campaign(tmp_path: Path, content: str, field: str) -> None:
    file = tmp_path / "campaign.json"
    file.write_text(content)
    with pytest.raises(InvalidInput) as caught:
        Campaign.read(file)
    assert caught.value.field == field
