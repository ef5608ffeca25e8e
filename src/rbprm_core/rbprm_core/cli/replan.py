"""The command `rbprm replan`."""

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


@click.command(short_help="Plan a scenario and replan as its environment is edited.")
@click.argument("scenario", default="replanning")
@click.option("--seed", default=0, show_default=True, help="Seed of the first execution.")
@click.option(
    "--edits",
    type=click.IntRange(min=1),
    help="Number of edits, in executions with consecutive seeds; by default the edits of one.",
)
@click.option("--time-limit", type=float, help="Seconds for each plan; by default the scenario's.")
@click.option(
    "--out",
    type=click.Path(dir_okay=False, path_type=Path),
    help="Plan file for the remaining sequence after the last edit.",
)
def replan(
    scenario: str, seed: int, edits: int | None, time_limit: float | None, out: Path | None
) -> None:
    """Plan SCENARIO and simulate its execution while the edits of its file are applied.

    Prints for each edit the number of invalid states, the state from which the sequence was
    planned anew, the times, and violations that the check finds in the remaining sequence.
    """
    loaded = load_scenario(scenario)
    if seed < 0:
        raise InvalidInput("seed", seed, "must not be negative")
    if out is not None and not out.absolute().parent.is_dir():
        raise InvalidInput("out", str(out), "its folder does not exist")
    model = loaded.load_robot()
    limit = loaded.request_text(model.name).time_limit if time_limit is None else time_limit
    limit = finite_number("time_limit", limit, low=MIN_TIME_LIMIT)
    console = Console(soft_wrap=True)
    with StageBars(console) as bars:
        data = load_robot_data(model, bars.robot_data)
    applied: list[AppliedEdit] = []
    for edit in replanning_benchmark(
        loaded, data, seed, len(loaded.edits) if edits is None else edits, limit
    ):
        console.print(_line(edit), markup=False, highlight=False)
        for fault in (edit.failure, *edit.violations):
            if fault:
                console.print(f"  {fault}", style="red", markup=False)
        applied.append(edit)
    console.print(summary(applied))
    if out is not None:
        applied[-1].plan.write(out)
        console.print(f"written to {out}")
    if not all(edit.valid for edit in applied):
        raise click.exceptions.Exit(1)


def _line(edit: AppliedEdit) -> str:
    """A line of text on an edit."""
    head = f"seed {edit.seed}, {edit.name} at state {edit.executed}"
    times = f"validity {1e3 * edit.validity:.1f} ms"
    if not edit.invalid:
        return f"{head}: plan kept ({times})"
    first = edit.invalid[0]
    reason = first.reason.name.lower().replace("_", " ")
    head = f"{head}: {len(edit.invalid)} invalid states, first {first.index} ({reason})"
    if edit.failure:
        return f"{head} ({times})"
    return (
        f"{head}; planned anew from state {edit.from_state}, {edit.states} states "
        f"({times}, replanning {1e3 * edit.replanning:.0f} ms)"
    )


def summary(applied: list[AppliedEdit]) -> Table:
    """A table of the numbers and times of all edits.

    Args:
        applied: the edits.
    """
    revised = [1e3 * edit.seconds for edit in applied if edit.from_state >= 0]
    validity = [1e3 * edit.validity for edit in applied]
    table = Table(title="edits", show_header=False)
    table.add_row("applied", str(len(applied)))
    table.add_row("plan kept", str(sum(not edit.invalid for edit in applied)))
    table.add_row("planned anew", str(len(revised)))
    table.add_row("valid by the check", str(sum(edit.valid for edit in applied)))
    for name, times in (("validity test [ms]", validity), ("edit to revision [ms]", revised)):
        if times:
            median, high = np.percentile(times, [50, 95])
            text = f"median {median:.1f}, 95 % {high:.1f}, maximum {max(times):.1f}"
            table.add_row(name, text)
    return table
