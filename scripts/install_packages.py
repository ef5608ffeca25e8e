"""Step 3 of set-up: install requirements/*.txt with pip, and show the progress.

The output of pip goes to .venv/pip.log; its last lines are shown if pip fails.
"""

from __future__ import annotations

import subprocess
import sys
import sysconfig
import threading
import time
from pathlib import Path

LOG = Path(sys.prefix) / "pip.log"
PINS = Path("requirements/constraints.txt")
SITE = Path(sysconfig.get_paths()["purelib"])
PIP = [sys.executable, "-m", "pip", "install", "--retries=10", "--timeout=60", f"-c{PINS}"]


class Progress:
    """A status line, redrawn every second on a terminal, printed every 15 s elsewhere.

    Attributes:
        text: the status.
        start: start of the program, seconds of the monotonic clock.
    """

    def __init__(self) -> None:
        self.text, self.start, self.done = "", time.monotonic(), threading.Event()
        self.live = sys.stdout.isatty()
        self.thread = threading.Thread(target=self._run, daemon=True)
        self.thread.start()

    def _run(self) -> None:
        while not self.done.wait(1 if self.live else 15):
            line = f"      {self.text}, {time.monotonic() - self.start:.0f} s"
            print(f"\r\033[K{line}" if self.live else f"{line}\n", end="", flush=True)

    def finish(self) -> None:
        """End the status line."""
        self.done.set()
        self.thread.join()
        print("\r\033[K" if self.live else "", end="", flush=True)


def run(command: list[str], progress: Progress, total: int) -> None:
    """Run pip and count the packages that it has resolved; end the program if pip fails.

    Args:
        command: the command.
        progress: status line that shows the count.
        total: expected number of packages.
    """
    resolved = 0
    with (
        LOG.open("a") as log,
        subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        ) as pip,
    ):
        assert pip.stdout is not None
        for line in pip.stdout:
            log.write(line)
            resolved += line.startswith(("Collecting ", "Requirement already satisfied: "))
            progress.text = f"fetching: {min(resolved, total)} of {total} packages"
            if line.startswith("Installing collected packages"):
                progress.text = f"unpacking {line.count(',') + 1} packages (half a minute or more)"
    if pip.returncode:
        progress.finish()
        print("".join(LOG.read_text().splitlines(keepends=True)[-20:]), file=sys.stderr)
        sys.exit(f"pip failed; its output is in {LOG}")


def main() -> None:
    """Install all pinned packages."""
    total = sum("==" in line for line in PINS.read_text().splitlines())
    print(f"[3/5] installing {total} pinned packages into .venv (2 GB of disk)", flush=True)
    LOG.unlink(missing_ok=True)
    progress = Progress()
    # First the pinned installers, with which the following packages are built.
    run([*PIP, "pip", "setuptools"], progress, 2)
    # empy is distributed as a source archive only.
    build = ["--no-build-isolation", "--only-binary=:all:", "--no-binary=empy"]
    inputs = [f"-rrequirements/{name}.txt" for name in ("core", "ros", "dev")]
    run([*PIP, *build, *inputs], progress, total)
    progress.finish()
    print(f"      done in {time.monotonic() - progress.start:.0f} s", flush=True)


if __name__ == "__main__":
    main()
