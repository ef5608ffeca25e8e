"""`rbprm scenarios` and `rbprm robots`."""

from __future__ import annotations

from itertools import takewhile

import click

from rbprm_core.robot import known_robots, load_description
from rbprm_core.scenario import known_scenarios, load_scenario


@click.command()
def scenarios() -> None:
    """List the scenarios that come with the package.

    Of each the robots, start and goal, and what it is.
    """
    known = known_scenarios()
    width = max(map(len, known)) + 2
    for name, file in known.items():
        text = load_scenario(name)
        request = text.request
        start, goal = request.start.position, request.goal.position
        others = [robot for robot in text.robots if robot != text.robot]
        also = f", also {', '.join(others)}" if others else ""
        click.echo(f"{name:<{width}}{text.robot}{also}: {start} to {goal}")
        click.echo(" " * width + first_sentence(file.read_text()))


def first_sentence(text: str) -> str:
    """The first sentence of the comment that a file begins with."""
    lines = takewhile(lambda line: line.startswith("#"), text.splitlines())
    comment = " ".join(line.strip("# ") for line in lines)
    return comment.partition(". ")[0].rstrip(".") + "."


@click.command()
def robots() -> None:
    """List the robots that come with the package."""
    for name in known_robots():
        text = load_description(name)
        limbs = ", ".join(limb.name for limb in text.limbs)
        click.echo(f"{name:<16}{len(text.limbs)} limbs: {limbs}")
