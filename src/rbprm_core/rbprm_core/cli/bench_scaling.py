"""The command `rbprm bench-scaling`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import click
from rich.console import Console
from rich.progress import Progress, TaskID

from rbprm_core.errors import InvalidInput


@click.command("bench-scaling", short_help="Measure the growth of planning time.")
@click.argument("what", type=click.Choice(["length", "surfaces"]), nargs=-1)
@click.option("--seeds", default=3, show_default=True, help="Number of seeds.")
@click.option("--sizes", help="Sizes, comma-separated; by default 1,2,4,8 or 10,100,1000,10000.")
@click.option("--out", type=click.Path(file_okay=False, path_type=Path), default="bench_output",
              show_default=True, help="Folder for JSON, tables and plots.")  # fmt: skip
def bench_scaling(what: tuple[str, ...], seeds: int, sizes: str | None, out: Path) -> None:
    """Measure the growth of planning time with WHAT: length, surfaces, or (by default) both.

    With length, HyQ crosses the rubble, repeated 1, 2, 4 and 8 times. With surfaces, HyQ walks
    round a block, with 10 to 10 000 surfaces out of its reach on both sides.
    """
    # Imported here so that other commands need not wait a second for the planner.
    from rbprm_core.bench.scaling import (
        LENGTHS,
        SURFACES,
        growth_with_length,
        growth_with_surfaces,
    )
    from rbprm_core.bench.scaling_report import growth_table, write_growth

    if seeds < 1:
        raise InvalidInput("seeds", seeds, "must be at least 1")
    kinds = {
        "length": (growth_with_length, LENGTHS),
        "surfaces": (growth_with_surfaces, SURFACES),
    }
    chosen = what or tuple(kinds)
    steps = {name: _sizes(sizes) or kinds[name][1] for name in chosen}
    console = Console(soft_wrap=True)
    for name in chosen:
        with Progress(console=console) as bar:
            task = bar.add_task(name, total=seeds * len(steps[name]))
            measure = kinds[name][0]
            growth = measure(steps[name], range(seeds), _advance(bar, task))
        console.print(growth_table(growth), markup=False, highlight=False)
        for path in write_growth(growth, out):
            console.print(f"written: {path}")


def _advance(bar: Progress, task: TaskID) -> Callable[[object], None]:
    return lambda record: bar.advance(task)


def _sizes(text: str | None) -> tuple[int, ...]:
    """Sizes of a comma-separated text, none for None."""
    if text is None:
        return ()
    try:
        return tuple(int(word) for word in text.split(","))
    except ValueError as error:
        raise InvalidInput("sizes", text, "must be integers separated by commas") from error
