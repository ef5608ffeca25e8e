"""`rbprm view`."""

from __future__ import annotations

from pathlib import Path

import click

from rbprm_core.plan_record import ContactPlan


@click.command(short_help="Write a page or a picture that shows a plan.")
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(dir_okay=False, path_type=Path), help="HTML page to write.")
@click.option("--picture", type=click.Path(dir_okay=False, path_type=Path), help="PNG to write.")
def view(file: Path, out: Path | None, picture: Path | None) -> None:
    """Write a self-contained HTML page that shows the plan in FILE in 3-D."""
    # Imported here: k3d and matplotlib take a second that the other commands need not wait for.
    from rbprm_core.view.page import write_page
    from rbprm_core.view.picture import write_picture

    result = ContactPlan.read(file)
    page = out or file.with_suffix(".html")
    write_page(result, page)
    click.echo(f"written to {page}")
    if picture is not None:
        write_picture(result, picture)
        click.echo(f"written to {picture}")
