"""The command `rbprm calibrate`."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from rbprm_core.errors import InvalidInput
from rbprm_core.scenario import load_scenario

if TYPE_CHECKING:
    from rbprm_core.calibration import ScaleCounts


@click.command(short_help="Measure errors of the reachability condition by trunk scale.")
@click.argument("robot")
@click.argument("scenarios", nargs=-1, required=True)
@click.option(
    "--samples", default=1000, show_default=True, help="Root configurations in each scenario."
)
@click.option("--seed", default=0, show_default=True, help="Seed of all random numbers.")
@click.option(
    "--json",
    "file",
    type=click.Path(dir_okay=False, path_type=Path),
    help="JSON file for the counts.",
)
def calibrate(
    robot: str, scenarios: tuple[str, ...], samples: int, seed: int, file: Path | None
) -> None:
    """Measure errors of the reachability condition of ROBOT in SCENARIOS for scales s of its trunk.

    The table is that of Tonneau et al. 2018, table 1: shares of random root configurations at which
    the condition holds although no contact configuration was found (false positive), and at which
    it does not hold although one was found (false negative).
    """
    # Imported here so that other commands need not wait a second for the planner.
    from rbprm_core.calibration import calibrate as count
    from rbprm_core.robot.data import load_robot_data

    for field, value, minimum in (("samples", samples, 1), ("seed", seed, 0)):
        if value < minimum:
            raise InvalidInput(field, value, f"must be at least {minimum}")
    if file is not None and not file.absolute().parent.is_dir():
        raise InvalidInput("json", str(file), "its folder does not exist")
    loaded = [load_scenario(name) for name in scenarios]
    models = [scenario.load_robot(robot) for scenario in loaded]
    requests = [
        scenario.request_for(model, seed) for scenario, model in zip(loaded, models, strict=True)
    ]
    console = Console()
    found: dict[str, list[ScaleCounts]] = {}
    with _bar(console) as bar:
        for scenario, model, request in zip(loaded, models, requests, strict=True):
            task = bar.add_task(scenario.name, total=samples)
            found[scenario.name] = count(
                request,
                load_robot_data(model),
                scenario.scene(),
                samples,
                seed,
                report=lambda done, task=task: bar.update(task, completed=done),  # type: ignore[misc]
            )
    own = models[0].description.volumes.trunk_scale
    for name, rows in found.items():
        console.print(_table(f"{models[0].name}: {name}", rows, own))
    if len(found) > 1:
        console.print(_table(f"{models[0].name}: all scenarios", _sums(found.values()), own))
    if file is not None:
        counts = {name: [dataclasses.asdict(row) for row in rows] for name, rows in found.items()}
        content = {"robot": models[0].name, "samples": samples, "seed": seed, "scenarios": counts}
        file.write_text(json.dumps(content, indent=1) + "\n")


def _bar(console: Console) -> Progress:
    columns = (
        TextColumn("{task.description:<12}"), BarColumn(), MofNCompleteColumn(),
        TimeElapsedColumn(),
    )  # fmt: skip
    return Progress(*columns, console=console)


def _table(title: str, rows: Sequence[ScaleCounts], own: float) -> Table:
    """A table with one row for each scale; `own` is the scale of the robot's file."""
    table = Table(title=title, caption=f"s in the robot's file: {own:g}")
    for name in (
        "scale s",
        "false positive",
        "false negative",
        "condition holds",
        "contacts found",
    ):
        table.add_column(name, justify="right")
    for row in rows:
        shares = (row.false_positive_rate, row.false_negative_rate, row.holds_rate, row.stands_rate)
        table.add_row(f"{row.scale:g}", *(f"{share:.1%}" for share in shares))
    return table


def _sums(tables: Iterable[Sequence[ScaleCounts]]) -> list[ScaleCounts]:
    """Sums over scenarios with equal numbers of samples, one entry for each scale."""
    from rbprm_core.calibration import ScaleCounts

    columns = [[dataclasses.astuple(row) for row in rows] for rows in zip(*tables, strict=True)]
    return [
        ScaleCounts(rows[0][0], *(sum(counts) for counts in list(zip(*rows, strict=True))[1:]))
        for rows in columns
    ]
