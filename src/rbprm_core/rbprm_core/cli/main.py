"""The program `rbprm`: its commands, and the texts and exit codes of errors."""

from __future__ import annotations

import sys
import traceback
import warnings

import click
from rich.console import Console

from rbprm_core.cli.bench import bench
from rbprm_core.cli.bench_scaling import bench_scaling
from rbprm_core.cli.calibrate import calibrate
from rbprm_core.cli.check import check
from rbprm_core.cli.listing import robots, scenarios
from rbprm_core.cli.plan import plan
from rbprm_core.cli.posture import posture
from rbprm_core.cli.replan import replan
from rbprm_core.cli.view import view
from rbprm_core.errors import ErrorCode, RbprmError
from rbprm_core.version import __version__

EXIT_INTERNAL = 70
EXIT_INTERRUPTED = 130


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="rbprm")
def cli() -> None:
    """Plan acyclic multi-contact sequences for legged robots.

    \b
    Exit codes: 0 success, 1 the plan is invalid or no posture was found,
    2 invalid input, 3 start not reachable, 4 goal not reachable,
    5 no guide found, 6 no contact sequence found, 7 time limit reached,
    70 internal error, 130 interrupted.
    """


for command in (
    plan,
    posture,
    replan,
    check,
    view,
    bench,
    bench_scaling,
    calibrate,
    scenarios,
    robots,
):
    cli.add_command(command)


def main() -> None:
    """Run a command; each expected failure prints one line and has its own exit code."""
    with warnings.catch_warnings():
        warnings.showwarning = _show_warning
        _run()


def _run() -> None:
    try:
        # Outside its standalone mode click returns the code of an Exit instead of exiting with it.
        sys.exit(cli(standalone_mode=False))
    except click.ClickException as error:
        error.show()
        sys.exit(error.exit_code)
    except (click.Abort, KeyboardInterrupt):
        _complain("interrupted")
        sys.exit(EXIT_INTERRUPTED)
    except RbprmError as error:
        _complain(str(error))
        sys.exit(EXIT_INTERNAL if error.code is ErrorCode.INTERNAL else int(error.code))
    except Exception:  # an internal error: Python's exit code 1 would mean an invalid plan
        traceback.print_exc()
        _complain("internal error of rbprm; please report it with the lines above")
        sys.exit(EXIT_INTERNAL)


def _show_warning(message: Warning | str, *_: object, **__: object) -> None:
    """Print a warning as one line, without its place in the source."""
    console = Console(stderr=True, soft_wrap=True)
    console.print(f"rbprm: warning: {message}", style="yellow", markup=False)


def _complain(text: str) -> None:
    Console(stderr=True, soft_wrap=True).print(f"rbprm: {text}", style="red", markup=False)


if __name__ == "__main__":
    main()
