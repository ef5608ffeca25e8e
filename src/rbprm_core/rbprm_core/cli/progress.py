"""Progress bars of the stages of planning."""

from __future__ import annotations

from types import TracebackType

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn

from rbprm_core.budget import Progress as Stage


class StageBars:
    """One progress bar for each stage, added when the stage begins.

    Args:
        console: console to show the bars on.
    """

    def __init__(self, console: Console) -> None:
        columns = (
            TextColumn("{task.description:<12}"),
            BarColumn(),
            TextColumn("{task.percentage:>3.0f}%"),
            TimeElapsedColumn(),
            TextColumn("{task.fields[note]}"),
        )
        self._progress = Progress(*columns, console=console)
        self._tasks: dict[str, TaskID] = {}

    def __enter__(self) -> StageBars:
        self._progress.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if kind is None:
            for task in self._progress.tasks:
                self._progress.update(task.id, completed=1.0)
        self._progress.stop()

    def robot_data(self, fraction: float) -> None:
        """Show the progress of computing the robot data.

        Args:
            fraction: share done, 0 to 1.
        """
        self._show("robot data", fraction, "")

    def planning(self, stage: Stage) -> None:
        """Show the progress of planning; a new stage completes the bars of earlier ones.

        Args:
            stage: progress of a stage.
        """
        note = f"{stage.states} states" if stage.states else ""
        self._show(stage.stage, stage.fraction, note)

    def seed(self, seed: int, stage: Stage) -> None:
        """Show the progress of one of several seeds in the seed's own bar.

        Args:
            seed: the seed.
            stage: progress of a stage.
        """
        states = f", {stage.states} states" if stage.states else ""
        name, note = f"seed {seed}", f"{stage.stage}{states}"
        if name not in self._tasks:
            self._tasks[name] = self._progress.add_task(name, total=1.0, note=note)
        self._progress.update(self._tasks[name], completed=stage.fraction, note=note)

    def _show(self, name: str, fraction: float, note: str) -> None:
        if name not in self._tasks:
            for task in self._progress.tasks:
                self._progress.update(task.id, completed=1.0)
            self._tasks[name] = self._progress.add_task(name, total=1.0, note=note)
        self._progress.update(self._tasks[name], completed=fraction, note=note)
