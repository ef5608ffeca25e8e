"""The command `rbprm bench`."""

from __future__ import annotations

from itertools import product
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING

import click
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from rbprm_core.errors import InvalidInput, RbprmError
from rbprm_core.scenario import known_scenarios

if TYPE_CHECKING:
    from rbprm_core.bench import Campaign, RunRecord


@click.command(short_help="Plan scenarios with many seeds; write tables and plots.")
@click.argument("scenarios", nargs=-1)
@click.option("--seeds", default=50, show_default=True, help="Number of consecutive seeds.")
@click.option("--first-seed", default=0, show_default=True, help="First seed.")
@click.option("--robot", help="Known robot or robot file; by default each scenario's own.")
@click.option(
    "--robustness",
    type=float,
    multiple=True,
    help="Minimum raw b0 in newtons instead of the scenarios' own; may be repeated.",
)
@click.option("--time-limit", type=float, help="Seconds for each run; by default the scenario's.")
@click.option(
    "--jobs", default=1, show_default=True, help="Runs at the same time, each in one thread."
)
@click.option(
    "--backend",
    default="loky",
    show_default=True,
    help="joblib backend that distributes the runs, such as loky or dask.",
)
@click.option("--scheduler", help="Address of the Dask scheduler, for --backend dask.")
@click.option("--out", type=click.Path(file_okay=False, path_type=Path), default="bench_output",
              show_default=True, help="Folder for JSON, tables and plots.")  # fmt: skip
@click.option("--resume", is_flag=True, help="Keep the runs in the folder; run the missing ones.")
def bench(
    scenarios: tuple[str, ...],
    seeds: int,
    first_seed: int,
    robot: str | None,
    robustness: tuple[float, ...],
    time_limit: float | None,
    jobs: int,
    backend: str,
    scheduler: str | None,
    out: Path,
    resume: bool,
) -> None:
    """Plan SCENARIOS (by default all known ones) with many seeds and check every plan.

    Writes campaign.json, campaign.md (tables as those of Tonneau et al. 2018, with the published
    figures) and plots into a folder. Ctrl-C ends the campaign and keeps the finished runs.
    """
    # Imported here so that other commands need not wait a second for the planner and joblib.
    from rbprm_core.bench import Campaign, Case, run_campaign, write_campaign

    if seeds < 1:
        raise InvalidInput("seeds", seeds, "must be at least 1")
    if scheduler is not None and backend != "dask":
        raise InvalidInput("scheduler", scheduler, f"is not used by backend {backend}")
    names = scenarios or tuple(known_scenarios())
    cases = [
        Case(name, robot, threshold, time_limit)
        for name, threshold in product(names, robustness or [None])
    ]
    _make(out)
    before = Campaign.read(out / "campaign.json") if resume else None
    console = Console()
    with CampaignBar(console, len(cases) * seeds) as bar:
        campaign = run_campaign(
            cases,
            range(first_seed, first_seed + seeds),
            jobs=jobs,
            backend=backend,
            backend_options={"scheduler_host": scheduler} if scheduler else None,
            on_record=bar.run,
            on_robot_data=bar.robot_data,
            before=before,
        )
    console.print(overview(campaign))
    for path in write_campaign(campaign, out):
        console.print(f"written: {path}")
    if campaign.stopped == "interrupted":
        raise KeyboardInterrupt
    if campaign.stopped:
        raise RbprmError(f"{campaign.stopped} (the runs before that are kept)")


class CampaignBar:
    """Progress bar of a campaign with the number of successful runs.

    Args:
        console: console to show the bar on.
        total: number of runs.
    """

    def __init__(self, console: Console, total: int) -> None:
        columns = (
            TextColumn("{task.description:<12}"),
            BarColumn(),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
            TextColumn("{task.fields[note]}"),
        )
        self._progress = Progress(*columns, console=console)
        self._task = self._progress.add_task("robot data", total=total, note="")
        self._successes = self._done = 0

    def __enter__(self) -> CampaignBar:
        self._progress.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._progress.stop()

    def robot_data(self, fraction: float) -> None:
        """Show the progress of computing a robot's data.

        Args:
            fraction: share done, 0 to 1.
        """
        note = f"{fraction:.0%}" if fraction < 1 else ""
        self._progress.update(self._task, note=note)

    def run(self, record: RunRecord) -> None:
        """Show one more finished run.

        Args:
            record: record of the run.
        """
        self._done += 1
        self._successes += record.success
        note = f"{self._successes} of {self._done} succeeded, last: {record.scenario}"
        self._progress.update(self._task, description="runs", completed=self._done, note=note)


def _make(folder: Path) -> None:
    """Make the folder before the runs, so that they are not lost where it cannot be made."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InvalidInput("out", str(folder), f"cannot be made: {error.strerror}") from error


def overview(campaign: Campaign) -> Table:
    """A table of the main figures of a campaign, one row for each case.

    Args:
        campaign: the campaign.
    """
    table = Table(title=f"{len(campaign.records)} of {campaign.requested} runs")
    for head in ("scenario", "robot", "b0 [N]", "success", "median", "maximum", "per transition"):
        table.add_column(head, justify="left" if head in ("scenario", "robot") else "right")
    for case in campaign.aggregates:
        total, each = case.total, case.per_transition
        table.add_row(
            case.scenario,
            case.robot,
            f"{case.robustness:g}",
            f"{case.successes} of {case.runs}",
            f"{total.median:.2f} s" if total else "",
            f"{total.maximum:.2f} s" if total else "",
            f"{1e3 * each.median:.1f} ms" if each else "",
        )
    return table
