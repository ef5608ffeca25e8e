"""`rbprm check`."""

from __future__ import annotations

from pathlib import Path

import click

from rbprm_core.check import check_plan
from rbprm_core.plan import ContactPlan


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
def check(file: Path) -> None:
    """Check the plan in FILE on its own: one line a violation, and exit code 1 if there is any."""
    report = check_plan(ContactPlan.read(file))
    for violation in report.violations:
        click.echo(str(violation))
    if not report.valid:
        click.echo(f"invalid: {len(report.violations)} violations", err=True)
        raise click.exceptions.Exit(1)
    click.echo(f"valid: {report.states} states, least robustness {report.least_robustness:.2f} N")
