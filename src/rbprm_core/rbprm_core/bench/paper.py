"""The figures published in Tonneau et al. 2018, for comparison ("the paper" in this package)."""

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
"""Minimum, mean and maximum."""


class PaperEntry(Record):
    """The published figures of one scenario; None for a figure that the paper does not give.

    Attributes:
        scenarios: names of the scenarios of this package that correspond to it.
        title: name of the scenario in the paper.
        robot: name of the robot in the paper.
        source: tables or section of the paper.
        note: a remark.
        transitions: number of contact transitions.
        guide: time of the guide planner, milliseconds.
        equilibrium: time of the equilibrium tests, milliseconds.
        collision: time of the collision tests, milliseconds.
        projection: time of inverse kinematics, milliseconds.
        total: time of planning, milliseconds.
        per_transition: mean time for one contact transition, milliseconds.
        success: share of the runs that succeeded, per cent.
        contacts_found: share of the attempts to make a contact that succeeded, per cent.
        kinematic_failures: share of the attempts that failed for want of a reachable candidate free
            of collision, per cent.
        equilibrium_failures: share of the attempts that failed for want of equilibrium, per cent.
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
    """The content of the file `paper.toml`.

    Attributes:
        entries: figures of the paper's scenarios.
    """

    entries: tuple[PaperEntry, ...]


@cache
def paper_figures() -> dict[str, PaperEntry]:
    """Published figures by name of scenario, for the scenarios that correspond to one."""
    path = Path(__file__).with_name("paper.toml")
    figures = parse_record(PaperFigures, read_toml(str(path), {}, "paper"), "paper")
    return {name: entry for entry in figures.entries for name in entry.scenarios}
