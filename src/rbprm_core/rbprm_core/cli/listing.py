"""The commands `rbprm scenarios` and `rbprm robots`."""

from __future__ import annotations

from itertools import takewhile

import click

from rbprm_core.robot import known_robots, load_description
from rbprm_core.scenario import known_scenarios, load_scenario


@click.command()
def scenarios() -> None:
    """List the scenarios that come with the package.

    Prints robots, start, goal and a short description of each.
    """
    known = known_scenarios()
    width = max(map(len, known)) + 2
    for name, file in known.items():
        scenario = load_scenario(name)
        request = scenario.request
        start, goal = request.start.position, request.goal.position
        others = [robot for robot in scenario.robots if robot != scenario.robot]
        also = f", also {', '.join(others)}" if others else ""
        click.echo(f"{name:<{width}}{scenario.robot}{also}: {start} to {goal}")
        click.echo(" " * width + first_sentence(file.read_text()))


def first_sentence(text: str) -> str:
    """The first sentence of the comment at the beginning of a TOML file.

    Args:
        text: content of the file.
    """
    lines = takewhile(lambda line: line.startswith("#"), text.splitlines())
    comment = " ".join(line.strip("# ") for line in lines)
    return comment.partition(". ")[0].rstrip(".") + "."


@click.command()
def robots() -> None:
    """List the robots that come with the package."""
    for name in known_robots():
        description = load_description(name)
        limbs = ", ".join(limb.name for limb in description.limbs)
        click.echo(f"{name:<16}{len(description.limbs)} limbs: {limbs}")
