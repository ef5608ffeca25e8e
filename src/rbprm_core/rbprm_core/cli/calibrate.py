"""`rbprm calibrate`."""

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


@click.command(short_help="Measure the reachability condition by the trunk's scale.")
@click.argument("robot")
@click.argument("scenarios", nargs=-1, required=True)
@click.option("--samples", default=1000, show_default=True, help="Root configurations a scenario.")
@click.option("--seed", default=0, show_default=True, help="Of everything that is random.")
@click.option(
    "--json", "file", type=click.Path(dir_okay=False, path_type=Path), help="File for the counts."
)
def calibrate(
    robot: str, scenarios: tuple[str, ...], samples: int, seed: int, file: Path | None
) -> None:
    """Measure the reachability condition of ROBOT in SCENARIOS by the scale s of its trunk.

    As table 1 of the paper: shares of random root configurations at which the condition holds
    though no contact configuration was found (false positive), and at which it does not though one
    was (false negative).
    """
    # Imported here: the planner takes a second that other commands need not wait for.
    from rbprm_core.calibration import calibrate as count
    from rbprm_core.robot.data import load_robot_data

    for field, value, least in (("samples", samples, 1), ("seed", seed, 0)):
        if value < least:
            raise InvalidInput(field, value, f"must be at least {least}")
    if file is not None and not file.absolute().parent.is_dir():
        raise InvalidInput("json", str(file), "its folder does not exist")
    texts = [load_scenario(name) for name in scenarios]
    models = [text.load_robot(robot) for text in texts]
    requests = [text.request_for(model, seed) for text, model in zip(texts, models, strict=True)]
    console = Console()
    found: dict[str, list[ScaleCounts]] = {}
    with _bar(console) as bar:
        for text, model, request in zip(texts, models, requests, strict=True):
            task = bar.add_task(text.name, total=samples)
            found[text.name] = count(
                request,
                load_robot_data(model),
                text.scene(),
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
    table = Table(title=title, caption=f"the robot's own s is {own:g}")
    for name in ("value of s", "false positive", "false negative", "holds", "stands"):
        table.add_column(name, justify="right")
    for row in rows:
        shares = (row.false_positive_rate, row.false_negative_rate, row.holds_rate, row.stands_rate)
        table.add_row(f"{row.scale:g}", *(f"{share:.1%}" for share in shares))
    return table


def _sums(tables: Iterable[Sequence[ScaleCounts]]) -> list[ScaleCounts]:
    """The counts of several scenarios, of as many samples each, added up scale by scale."""
    from rbprm_core.calibration import ScaleCounts

    columns = [[dataclasses.astuple(row) for row in rows] for rows in zip(*tables, strict=True)]
    return [
        ScaleCounts(rows[0][0], *(sum(counts) for counts in list(zip(*rows, strict=True))[1:]))
        for rows in columns
    ]
