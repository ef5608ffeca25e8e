"""Plots of a campaign: time to solution, and success rate over the time limit."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from rbprm_core.bench.aggregate import CaseKey, case_key
from rbprm_core.bench.paper import PaperEntry, paper_figures
from rbprm_core.bench.record import RunRecord
from rbprm_core.view.palette import INK, LIMBS

if TYPE_CHECKING:
    from rbprm_core.bench.campaign import Campaign

WIDTH = 8.0  # inches
DOTS = 120  # per inch
STYLES = ("-", "--", ":", "-.")  # of lines, for more cases than colours
SECONDS = "{x:g}"
PAPER = "D"  # marker of published figures
Case = tuple[str, list[RunRecord]]
"""Label and runs of a case."""


def write_plots(campaign: Campaign, folder: Path) -> tuple[Path, ...]:
    """Write the plots of a campaign as PNG files.

    Args:
        campaign: a campaign with at least one record.
        folder: an existing folder.

    Returns:
        The files written.
    """
    cases = _cases(campaign.records)
    height = 1.6 + 0.45 * len(cases)
    return (
        write_figure(folder / "time_to_solution.png", height, lambda ax: _draw_times(ax, cases)),
        write_figure(folder / "success_over_time.png", 4.5, lambda ax: _draw_success(ax, cases)),
    )


def write_figure(path: Path, height: float, draw: Callable[[Axes], None]) -> Path:
    """Write a PNG file with one pair of axes.

    Args:
        path: path of the file.
        height: height of the figure, inches.
        draw: function that draws on the axes.

    Returns:
        The path of the file.
    """
    figure = Figure(figsize=(WIDTH, height), dpi=DOTS, layout="constrained")
    FigureCanvasAgg(figure)
    ax = figure.add_subplot()
    draw(ax)
    ax.spines[["top", "right"]].set_visible(False)
    figure.savefig(path)
    return path


def _cases(records: Sequence[RunRecord]) -> list[Case]:
    """The cases of some records, in the order of the records."""
    cases: dict[CaseKey, list[RunRecord]] = {}
    for record in records:
        cases.setdefault(case_key(record), []).append(record)
    return [(f"{key[0]}, {key[1]}, {key[3]:g} N", runs) for key, runs in cases.items()]


def _draw_times(ax: Axes, cases: list[Case]) -> None:
    """Draw quartiles of each case as a box, its runs as dots, the published mean as a diamond."""
    for row, (_, runs) in enumerate(cases):
        times = [run.wall for run in runs if run.success]
        color = _color(row)
        if times:
            ax.boxplot(
                times, positions=[row], orientation="horizontal", widths=0.5, showfliers=False,
                medianprops={"color": INK}, manage_ticks=False,
            )  # fmt: skip
        ax.plot(times, np.full(len(times), row), "o", color=color, alpha=0.4, markersize=4)
        paper = paper_figures().get(runs[0].scenario)
        if paper is not None and paper.total is not None:
            ax.plot(paper.total[1] / 1e3, row, PAPER, color="none", markeredgecolor=INK)
        ax.text(1.01, row, _share(runs), transform=ax.get_yaxis_transform(), va="center")
    ax.set_yticks(range(len(cases)), [label for label, _ in cases])
    ax.set_ylim(len(cases) - 0.5, -0.5)
    ax.set_xscale("log")
    ax.xaxis.set_major_formatter(SECONDS)
    ax.set_xlabel("seconds to a valid plan (dots: runs; diamonds: means of Tonneau et al. 2018)")
    ax.grid(axis="x", alpha=0.3)


def _draw_success(ax: Axes, cases: list[Case]) -> None:
    """Draw the share of the runs that would have succeeded under a shorter time limit."""
    latest = max(run.wall for _, runs in cases for run in runs)
    for row, (label, runs) in enumerate(cases):
        times = np.sort([run.wall for run in runs if run.success])
        shares = 100 * np.arange(1, len(times) + 1) / len(runs)
        ends = [100 * len(times) / len(runs)]
        x = np.concatenate([times[:1], times, [latest]])
        y = np.concatenate([[0.0], shares, ends]) if len(times) else ends
        style = STYLES[row // len(LIMBS) % len(STYLES)]
        ax.step(x, y, style, where="post", color=_color(row), label=label)
        _mark_paper(ax, paper_figures().get(runs[0].scenario), _color(row))
    ax.set_xscale("log")
    ax.xaxis.set_major_formatter(SECONDS)
    ax.set_ylim(0, 103)
    ax.set_xlabel("time limit [s]")
    ax.set_ylabel("success [%]")
    ax.grid(alpha=0.3)
    ax.legend(title="diamonds: mean time and success of Tonneau et al. 2018", fontsize="small")


def _mark_paper(ax: Axes, paper: PaperEntry | None, color: str) -> None:
    """Mark the published mean time and success rate of a scenario."""
    if paper is not None and paper.total is not None and paper.success is not None:
        ax.plot(paper.total[1] / 1e3, paper.success, PAPER, color="none", markeredgecolor=color)


def _share(runs: list[RunRecord]) -> str:
    return f"{sum(run.success for run in runs)} of {len(runs)}"


def _color(row: int) -> str:
    return LIMBS[row % len(LIMBS)]
