"""`rbprm bench`."""

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


@click.command(short_help="Plan scenarios with many seeds; tables and plots.")
@click.argument("scenarios", nargs=-1)
@click.option("--seeds", default=50, show_default=True, help="Number of seeds.")
@click.option("--first-seed", default=0, show_default=True, help="The others follow it.")
@click.option("--robot", help="A known robot, or a robot file; each scenario's own by default.")
@click.option(
    "--robustness",
    type=float,
    multiple=True,
    help="Least raw b0 in newtons instead of the scenarios'; may be repeated.",
)
@click.option("--time-limit", type=float, help="Seconds a run; each scenario's by default.")
@click.option("--jobs", default=1, show_default=True, help="Runs at once, one thread each.")
@click.option(
    "--backend",
    default="loky",
    show_default=True,
    help="How joblib spreads the runs: loky, dask, or any other that it knows.",
)
@click.option("--scheduler", help="Address of the Dask scheduler, for --backend dask.")
@click.option("--out", type=click.Path(file_okay=False, path_type=Path), default="bench_output",
              show_default=True, help="Folder for JSON, tables and plots.")  # fmt: skip
@click.option("--resume", is_flag=True, help="Take the runs that the folder holds as done.")
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
    """Plan SCENARIOS (all known ones by default) with many seeds and check every plan.

    Leaves campaign.json, campaign.md (tables in the shape of the paper's, its figures beside) and
    plots in a folder. Ctrl-C ends the campaign and keeps the runs that are done.
    """
    # Imported here: the planner and joblib take a second that other commands need not wait for.
    from rbprm_core.bench import Campaign, Case, run_campaign, write_campaign

    if seeds < 1:
        raise InvalidInput("seeds", seeds, "must be at least 1")
    if scheduler is not None and backend != "dask":
        raise InvalidInput("scheduler", scheduler, f"means nothing to backend {backend}")
    names = scenarios or tuple(known_scenarios())
    cases = [
        Case(name, robot, least, time_limit) for name, least in product(names, robustness or [None])
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
    """How many runs are done, and how many of them succeeded."""

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
        """Show how much of a robot's data is there."""
        note = f"{fraction:.0%}" if fraction < 1 else ""
        self._progress.update(self._task, note=note)

    def run(self, record: RunRecord) -> None:
        """Show one more run."""
        self._done += 1
        self._successes += record.success
        note = f"{self._successes} of {self._done} succeeded, last: {record.scenario}"
        self._progress.update(self._task, description="runs", completed=self._done, note=note)


def _make(folder: Path) -> None:
    """Make the folder before hours of work, not after."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InvalidInput("out", str(folder), f"cannot be made: {error.strerror}") from error


def overview(campaign: Campaign) -> Table:
    """The figures that matter most, a row a case."""
    table = Table(title=f"{len(campaign.records)} of {campaign.requested} runs")
    for head in ("scenario", "robot", "b0 [N]", "success", "median", "worst", "per transition"):
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
