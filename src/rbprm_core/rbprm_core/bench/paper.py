"""The paper's own figures, to stand beside ours."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Annotated

from pydantic import Field

from rbprm_core.files import read_toml
from rbprm_core.validation import Record, parse_record

Milliseconds = Annotated[float, Field(ge=0)]
Percent = Annotated[float, Field(ge=0, le=100)]
Range = tuple[Milliseconds, Milliseconds, Milliseconds]
"""Least, average and worst."""


class PaperEntry(Record):
    """What the paper reports of one scenario; None where it is silent.

    Attributes:
        scenarios: names of ours that stand for it. title, robot: the paper's.
        source: table or section. note: what no number says.
        transitions: number of contact transitions.
        guide, equilibrium, collision, projection, total: milliseconds.
        per_transition: milliseconds.
        success: of the runs. contacts_found, kinematic_failures, equilibrium_failures: of the
            contacts asked of single limbs.
    """

    scenarios: tuple[str, ...]
    title: str
    robot: str
    source: str
    note: str = ""
    transitions: Annotated[int, Field(ge=1)] | None = None
    guide: Range | None = None
    equilibrium: Range | None = None
    collision: Range | None = None
    projection: Range | None = None
    total: Range | None = None
    per_transition: Milliseconds | None = None
    success: Percent | None = None
    contacts_found: Percent | None = None
    kinematic_failures: Percent | None = None
    equilibrium_failures: Percent | None = None


class PaperFigures(Record):
    """The file `paper.toml`."""

    entries: tuple[PaperEntry, ...]


@cache
def paper_figures() -> dict[str, PaperEntry]:
    """The paper's entry for each of our scenarios that stands for one of its own."""
    path = Path(__file__).with_name("paper.toml")
    figures = parse_record(PaperFigures, read_toml(str(path), {}, "paper"), "paper")
    return {name: entry for entry in figures.entries for name in entry.scenarios}
