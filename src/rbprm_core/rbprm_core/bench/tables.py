"""Markdown tables of a campaign, with the figures of Tonneau et al. 2018 for comparison."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from rbprm_core.bench.aggregate import Aggregate, Spread
from rbprm_core.bench.paper import PaperEntry, Range, paper_figures

if TYPE_CHECKING:
    from rbprm_core.bench.campaign import Campaign

NONE = "–"  # a figure that does not exist
PAPER = "Tonneau et al. 2018"
Row = Sequence[str]
"""Cells of a row."""


def markdown(campaign: Campaign) -> str:
    """The report of a campaign in Markdown.

    Args:
        campaign: the campaign.
    """
    found = campaign.aggregates
    parts = [
        "# Campaign",
        _origin(campaign),
        "## Overview",
        "Times are those of the successful runs, in seconds: preparing + guide + shortcuts + "
        "sequence. A run is successful if a plan was found within the time limit and satisfies "
        "every bound of the check, those at the goal included.",
        overview_table(found),
        "## Phases",
        "Median seconds of the successful runs. The columns from candidates to collision are "
        "operations inside the sequence; processor is the processor time of planning as a whole.",
        phases_table(found),
        f"## Times, as in table 2 of {PAPER}",
        "Milliseconds, minimum – mean – maximum, of the successful runs; per transition is the "
        "mean. The guide includes its shortcuts. The paper does not list candidates.",
        times_table(found),
        f"## Success, as in table 3 of {PAPER}",
        "Contacts: share of the attempts to make a contact with one limb. Roots in equilibrium: "
        "share of the root configurations tried along the guides, each counted once, that gave a "
        "state in equilibrium. Failed runs are included.",
        success_table(found),
        *_notes(found),
        "## Measures of the check",
        "Stable: share of the transitions of the successful runs in which the robot is in "
        "equilibrium without the moving contact at both ends, at one, at neither.",
        check_table(found),
        "## Failures",
        failures_table(found),
    ]
    return "\n\n".join(parts) + "\n"


def overview_table(found: Iterable[Aggregate]) -> str:
    """A table of the main figures, one row for each case.

    Args:
        found: figures of the cases.
    """
    head = (
        "scenario", "robot", "b0 ≥ [N]", "limit [s]", "success", "median [s]", "95 % [s]",
        "maximum [s]", "processor, median [s]", "transitions", "ms per transition",
        "ms per state", "violations", "distinct plans", "peak [MB]", f"{PAPER}: success, mean",
    )  # fmt: skip
    return table(head, [_overview(case) for case in found])


def _overview(case: Aggregate) -> Row:
    total, paper = case.total, paper_figures().get(case.scenario)
    return (
        f"`{case.scenario}`",
        case.robot,
        f"{case.robustness:g}",
        f"{case.time_limit:g}",
        f"{case.successes} of {case.runs}",
        f"{total.median:.2f}" if total else NONE,
        f"{total.p95:.2f}" if total else NONE,
        f"{total.maximum:.2f}" if total else NONE,
        f"{case.cpu.median:.2f}" if case.cpu else NONE,
        f"{case.transitions.median:.0f}" if case.transitions else NONE,
        f"{1e3 * case.per_transition.median:.1f}" if case.per_transition else NONE,
        f"{1e3 * case.per_state.median:.1f}" if case.per_state else NONE,
        str(case.violations),
        str(case.distinct_plans),
        f"{case.peak_memory / 1e6:.0f}",
        _paper_in_short(paper),
    )


def _paper_in_short(paper: PaperEntry | None) -> str:
    """Published success rate and mean time of a scenario, or the note on it."""
    if paper is None:
        return NONE
    if paper.success is None or paper.total is None:
        return paper.note or NONE
    return f"{paper.success:g} %, {paper.total[1] / 1e3:.2f} s"


def phases_table(found: Sequence[Aggregate]) -> str:
    """A table of the median seconds of every phase of the planner, one row for each case.

    Args:
        found: figures of the cases.
    """
    phases = tuple(dict.fromkeys(phase for case in found for phase in case.seconds))
    heads = (phase.removeprefix("sequence.") for phase in phases)
    rows = [
        (
            f"`{case.scenario}`",
            case.robot,
            *(_median(case.seconds.get(phase)) for phase in phases),
            _median(case.cpu),
        )
        for case in found
    ]
    return table(("scenario", "robot", *heads, "processor"), rows)


def times_table(found: Iterable[Aggregate]) -> str:
    """A table of times as table 2 of the paper, each case followed by the published row.

    Args:
        found: figures of the cases.
    """
    head = (
        "scenario (transitions)", "robot", "guide", "static equilibrium", "collision",
        "inverse kinematics", "candidates", "total", "per transition",
    )  # fmt: skip
    rows: list[Row] = []
    for case in found:
        rows.append(_our_times(case))
        paper = paper_figures().get(case.scenario)
        if paper is not None and paper.total is not None:
            rows.append(_paper_times(paper))
    return table(head, rows)


def _our_times(case: Aggregate) -> Row:
    seconds = case.seconds
    number = f" ({case.transitions.median:.0f})" if case.transitions else ""
    return (
        f"`{case.scenario}`{number}",
        f"{case.robot}, b0 {case.robustness:g} N",
        _milliseconds(case.guide),
        _milliseconds(seconds.get("sequence.statics")),
        _milliseconds(seconds.get("sequence.collision")),
        _milliseconds(seconds.get("sequence.projection")),
        _milliseconds(seconds.get("sequence.candidates")),
        _milliseconds(case.total),
        f"{1e3 * case.per_transition.mean:.1f}" if case.per_transition else NONE,
    )


def _paper_times(paper: PaperEntry) -> Row:
    return (
        f"{paper.title} ({paper.transitions})" if paper.transitions else paper.title,
        f"{PAPER}, {paper.robot}",
        _range(paper.guide),
        _range(paper.equilibrium),
        _range(paper.collision),
        _range(paper.projection),
        NONE,
        _range(paper.total),
        NONE if paper.per_transition is None else f"{paper.per_transition:g}",
    )


def success_table(found: Iterable[Aggregate]) -> str:
    """A table of success rates as table 3 of the paper, each case followed by the published row.

    Args:
        found: figures of the cases.
    """
    head = (
        "scenario", "robot", "success", "contacts found", "kinematic failure",
        "equilibrium failure", "roots in equilibrium",
    )  # fmt: skip
    rows: list[Row] = []
    for case in found:
        rows.append(_our_success(case))
        paper = paper_figures().get(case.scenario)
        if paper is not None and paper.success is not None:
            rows.append(_paper_success(paper))
    return table(head, rows)


def _our_success(case: Aggregate) -> Row:
    return (
        f"`{case.scenario}`",
        f"{case.robot}, b0 {case.robustness:g} N",
        _percent(100 * case.success),
        _share(case.contacts_found),
        _share(case.kinematic_failures),
        _share(case.equilibrium_failures),
        _share(case.roots_in_equilibrium),
    )


def _paper_success(paper: PaperEntry) -> Row:
    return (
        paper.title,
        f"{PAPER}, {paper.robot}",
        _percent(paper.success),
        _percent(paper.contacts_found),
        _percent(paper.kinematic_failures),
        _percent(paper.equilibrium_failures),
        NONE,
    )


def check_table(found: Iterable[Aggregate]) -> str:
    """A table of the check's violations and of its measures without a bound.

    Args:
        found: figures of the cases.
    """
    head = (
        "scenario", "robot", "invalid plans", "violations", "overhanging patches",
        "goal contacts missed", "stable at both ends", "at one", "at neither",
    )  # fmt: skip
    rows = [
        (
            f"`{case.scenario}`",
            case.robot,
            f"{case.invalid_plans} of {case.runs}",
            str(case.violations),
            str(case.overhanging),
            f"{case.goal_missed} of {case.runs}",
            *([_share(share) for share in case.support] if case.support else [NONE] * 3),
        )
        for case in found
    ]
    return table(head, rows)


def failures_table(found: Sequence[Aggregate]) -> str:
    """A table of the causes of failures, equal ones joined.

    Args:
        found: figures of the cases.
    """
    head = ("scenario", "robot", "runs", "code", "cause", "limb", "one of them", "its seed")
    rows = [
        (
            f"`{case.scenario}`",
            case.robot,
            f"{cause.runs} of {case.runs}",
            cause.failure.code,
            cause.failure.cause or NONE,
            cause.failure.limb or NONE,
            cause.failure.text,
            str(cause.seed),
        )
        for case in found
        for cause in case.causes
    ]
    return table(head, rows) if rows else "None."


def table(head: Row, rows: Iterable[Row]) -> str:
    """A Markdown table.

    Args:
        head: cells of the head.
        rows: cells of each row.
    """
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(_cell(text) for text in line)} |" for line in lines)


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("\n", " ")


def _origin(campaign: Campaign) -> str:
    """A sentence on the runs, the machine and the versions of a campaign."""
    machine = campaign.machine
    versions = ", ".join(f"{name} {number}" for name, number in machine.versions.items())
    done = f"{len(campaign.records)} of {campaign.requested} runs"
    stopped = f" (stopped: {campaign.stopped})" if campaign.stopped else ""
    return (
        f"{done}{stopped}, started {machine.date}, {campaign.jobs} at the same time "
        f"({campaign.backend}), each in one thread, robot data loaded before the time starts. "
        f"{machine.processor}, {machine.cores} cores, {machine.memory / 1e9:.0f} GB, "
        f"{machine.system}; Python {machine.python}, {versions}."
    )


def _notes(found: Iterable[Aggregate]) -> list[str]:
    notes = {}
    for case in found:
        paper = paper_figures().get(case.scenario)
        if paper is not None and paper.note:
            notes[paper.title] = f"- {PAPER}, {paper.title} ({paper.source}): {paper.note}"
    return ["\n".join(notes.values())] if notes else []


def _median(spread: Spread | None) -> str:
    return NONE if spread is None else f"{spread.median:.3f}"


def _milliseconds(spread: Spread | None) -> str:
    if spread is None:
        return NONE
    return _three(1e3 * spread.minimum, 1e3 * spread.mean, 1e3 * spread.maximum)


def _range(values: Range | None) -> str:
    return NONE if values is None else _three(*values)


def _three(minimum: float, mean: float, maximum: float) -> str:
    return f"{minimum:.0f} – {mean:.0f} – {maximum:.0f}"


def _share(value: float | None) -> str:
    return _percent(None if value is None else 100 * value)


def _percent(value: float | None) -> str:
    return NONE if value is None else f"{value:.1f} %"
