"""The command `rbprm view`."""

from __future__ import annotations

from pathlib import Path

import click

from rbprm_core.plan_record import ContactPlan


@click.command(short_help="Show a plan as an HTML page or a picture.")
@click.argument("file", type=click.Path(path_type=Path))
@click.option(
    "--out",
    type=click.Path(dir_okay=False, path_type=Path),
    help="HTML page to write; by default FILE with the suffix .html.",
)
@click.option(
    "--picture",
    type=click.Path(dir_okay=False, path_type=Path),
    help="PNG picture to write as well.",
)
def view(file: Path, out: Path | None, picture: Path | None) -> None:
    """Write a self-contained HTML page with a 3-D view of the plan in FILE."""
    # Imported here so that other commands need not wait a second for k3d and matplotlib.
    from rbprm_core.view.page import write_page
    from rbprm_core.view.picture import write_picture

    result = ContactPlan.read(file)
    page = out or file.with_suffix(".html")
    write_page(result, page)
    click.echo(f"written to {page}")
    if picture is not None:
        write_picture(result, picture)
        click.echo(f"written to {picture}")
