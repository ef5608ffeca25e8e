"""`rbprm scenarios` and `rbprm robots`."""

from __future__ import annotations

import click

from rbprm_core.robot import known_robots, load_description
from rbprm_core.scenario import known_scenarios, load_scenario


@click.command()
def scenarios() -> None:
    """List the scenarios that come with the package."""
    known = known_scenarios()
    width = max(map(len, known)) + 2
    for name in known:
        text = load_scenario(name)
        request = text.request
        start, goal = request.start.position, request.goal.position
        others = f", also {', '.join(text.robots)}" if text.robots else ""
        click.echo(f"{name:<{width}}{text.robot}{others}: {start} to {goal}")


@click.command()
def robots() -> None:
    """List the robots that come with the package."""
    for name in known_robots():
        text = load_description(name)
        limbs = ", ".join(limb.name for limb in text.limbs)
        click.echo(f"{name:<16}{len(text.limbs)} limbs: {limbs}")
