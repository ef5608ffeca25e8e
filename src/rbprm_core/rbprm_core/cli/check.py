"""The command `rbprm check`."""

from __future__ import annotations

import json
from pathlib import Path

import click

from rbprm_core.check import check_plan, figures
from rbprm_core.plan_record import ContactPlan


@click.command(short_help="Check a plan file independently of the planner.")
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--json", "as_json", is_flag=True, help="Print the whole report as JSON.")
def check(file: Path, as_json: bool) -> None:
    """Check the plan in FILE independently of the planner.

    Prints one line for each violation; the exit code is 1 if there is any.
    """
    report = check_plan(ContactPlan.read(file))
    if as_json:
        click.echo(json.dumps(report.document(), indent=1))
        raise click.exceptions.Exit(0 if report.valid else 1)
    for violation in report.violations:
        click.echo(str(violation))
    if not report.valid:
        click.echo(f"invalid: {len(report.violations)} violations", err=True)
        raise click.exceptions.Exit(1)
    click.echo(f"valid: {report.states} states, minimum robustness {report.min_robustness:.2f} N")
    for name, text in figures(report).items():
        click.echo(f"{name}: {text}")
