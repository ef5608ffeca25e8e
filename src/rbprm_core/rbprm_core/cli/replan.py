"""`rbprm replan`."""

from __future__ import annotations

from pathlib import Path

import click
import numpy as np
from rich.console import Console
from rich.table import Table

from rbprm_core.bench.replanning_benchmark import AppliedEdit, replanning_benchmark
from rbprm_core.budget import MIN_TIME_LIMIT
from rbprm_core.cli.progress import StageBars
from rbprm_core.errors import InvalidInput
from rbprm_core.robot.data import load_robot_data
from rbprm_core.scenario import load_scenario
from rbprm_core.validation import finite_number


@click.command(short_help="Plan, walk, and plan anew as the environment changes.")
@click.argument("scenario", default="replanning")
@click.option("--seed", default=0, show_default=True, help="Of the first walk.")
@click.option(
    "--edits",
    type=click.IntRange(min=1),
    help="Edits to play, walk after walk with the next seed; those of one walk by default.",
)
@click.option("--time-limit", type=float, help="Seconds a planning; the scenario's by default.")
@click.option(
    "--out",
    type=click.Path(dir_okay=False, path_type=Path),
    help="Plan file to write: what is left to be walked after the last edit.",
)
def replan(
    scenario: str, seed: int, edits: int | None, time_limit: float | None, out: Path | None
) -> None:
    """Plan SCENARIO and walk it while its environment is edited as its file says.

    At each edit: which states do not hold any more, from which one the way is planned anew, how
    long that takes, and what the check says of what is left to be walked.
    """
    text = load_scenario(scenario)
    if seed < 0:
        raise InvalidInput("seed", seed, "must not be negative")
    if out is not None and not out.absolute().parent.is_dir():
        raise InvalidInput("out", str(out), "its folder does not exist")
    model = text.load_robot()
    limit = text.request_text(model.name).time_limit if time_limit is None else time_limit
    limit = finite_number("time_limit", limit, low=MIN_TIME_LIMIT)
    console = Console(soft_wrap=True)
    with StageBars(console) as bars:
        data = load_robot_data(model, bars.robot_data)
    played: list[AppliedEdit] = []
    for edit in replanning_benchmark(
        text, data, seed, len(text.edits) if edits is None else edits, limit
    ):
        console.print(_line(edit), markup=False, highlight=False)
        for fault in (edit.failure, *edit.violations):
            if fault:
                console.print(f"  {fault}", style="red", markup=False)
        played.append(edit)
    console.print(summary(played))
    if out is not None:
        played[-1].plan.write(out)
        console.print(f"written to {out}")
    if not all(edit.valid for edit in played):
        raise click.exceptions.Exit(1)


def _line(edit: AppliedEdit) -> str:
    """One edit in one line."""
    head = f"seed {edit.seed}, {edit.name} at state {edit.executed}"
    took = f"validity {1e3 * edit.validity:.1f} ms"
    if not edit.invalid:
        return f"{head}: the plan stands ({took})"
    first = edit.invalid[0]
    why = first.reason.name.lower().replace("_", " ")
    head = f"{head}: {len(edit.invalid)} states invalid, first {first.index} ({why})"
    if edit.failure:
        return f"{head} ({took})"
    return (
        f"{head}; planned anew from {edit.from_state}, {edit.states} states "
        f"({took}, replanning {1e3 * edit.replanning:.0f} ms)"
    )


def summary(played: list[AppliedEdit]) -> Table:
    """All edits in a few rows."""
    revised = [1e3 * edit.seconds for edit in played if edit.from_state >= 0]
    validity = [1e3 * edit.validity for edit in played]
    table = Table(title="edits", show_header=False)
    table.add_row("played", str(len(played)))
    table.add_row("plan stood", str(sum(not edit.invalid for edit in played)))
    table.add_row("planned anew", str(len(revised)))
    table.add_row("clean by the check", str(sum(edit.valid for edit in played)))
    for name, times in (("validity, ms", validity), ("edit to revision, ms", revised)):
        if times:
            middle, high = np.percentile(times, [50, 95])
            text = f"median {middle:.1f}, 95 % {high:.1f}, most {max(times):.1f}"
            table.add_row(name, text)
    return table
