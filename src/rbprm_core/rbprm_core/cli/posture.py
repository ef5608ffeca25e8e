"""The command `rbprm posture`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import click
import numpy as np
from rich.console import Console

from rbprm_core.arrays import Array
from rbprm_core.body import Contact, State, Transition
from rbprm_core.cli.progress import StageBars
from rbprm_core.errors import InvalidInput
from rbprm_core.failure_text import failure_text
from rbprm_core.failures import Failure
from rbprm_core.plan_conversion.plan_to_states import states_from_plan
from rbprm_core.plan_conversion.states_to_plan import bare_plan, state_entry
from rbprm_core.plan_record import ContactPlan
from rbprm_core.planning_input import PlanningInput, input_from_plan
from rbprm_core.posture import (
    PostureProblem,
    PostureSetting,
    WitnessEnd,
    generate_posture,
    posture_setting,
    witness_problem,
)
from rbprm_core.posture.constraints.rows import Constraint
from rbprm_core.posture.constraints.tasks import Upright
from rbprm_core.posture.model import REACH, PostureModel
from rbprm_core.posture.protocol import THOROUGH
from rbprm_core.posture.quadratic_program import SOLVERS
from rbprm_core.posture.quality import PostureQuality, posture_quality
from rbprm_core.posture.witness import ENDS
from rbprm_core.robot.data import load_robot_data
from rbprm_core.validation import finite_number

UPRIGHT_ANGLE = np.radians(5.0)
"""Largest angle between an upright frame's z axis and the vertical, radians."""
UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, eq=False)
class Task:
    """A posture problem of a plan.

    Attributes:
        name: text that names it.
        problem: the problem.
        start: (nq,) planned configuration, from which the search starts.
    """

    name: str
    problem: PostureProblem
    start: Array


@click.command(short_help="Find a posture for a state or a transition of a plan.")
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--state", type=int, help="Index of the state whose contacts all carry the robot.")
@click.option("--transition", type=int, help="Index of the transition, that of its first state.")
@click.option(
    "--end",
    type=click.Choice([str(end) for end in WitnessEnd]),
    help="End of the transition; by default the first that it has.",
)
@click.option(
    "--min-robustness",
    default=5.0,
    show_default=True,
    help="Smallest b0 on the contacts that carry, N.",
)
@click.option("--max-torque-ratio", type=float, help="Largest share of the joints' effort limits.")
@click.option("--upright", multiple=True, metavar="FRAME", help="Keep a frame's z axis vertical.")
@click.option("--solver", type=click.Choice(SOLVERS), default="daqp", show_default=True)
@click.option(
    "--out",
    type=click.Path(dir_okay=False, path_type=Path),
    help="Plan file to write, with the posture as its only state.",
)
@click.option(
    "--page",
    type=click.Path(dir_okay=False, path_type=Path),
    help="HTML page of the posture to write.",
)
@click.option(
    "--picture",
    type=click.Path(dir_okay=False, path_type=Path),
    help="PNG picture of the posture to write.",
)
def posture(
    file: Path,
    state: int | None,
    transition: int | None,
    end: str | None,
    min_robustness: float,
    max_torque_ratio: float | None,
    upright: tuple[str, ...],
    solver: str,
    out: Path | None,
    page: Path | None,
    picture: Path | None,
) -> None:
    """Find a posture for a state or a transition of the plan in FILE.

    For a transition it is the witness posture of one end: the limb that moves is on its contact,
    and the other contacts carry the robot. Prints what was found, or the constraint that cannot be
    met, with exit code 1.
    """
    finite_number("min_robustness", min_robustness)
    if max_torque_ratio is not None:
        finite_number("max_torque_ratio", max_torque_ratio, low=1e-6)
    plan = ContactPlan.read(file)
    given = input_from_plan(plan)
    robot = given.robot
    states = states_from_plan(plan.states, robot)
    tasks = [Upright(robot, name, UP, UP, UPRIGHT_ANGLE) for name in upright]
    if (state is None) == (transition is None):
        raise InvalidInput("state", state, "give either a state or a transition")
    if state is not None:
        task = _of_state(states, state, min_robustness, max_torque_ratio, tasks)
    else:
        assert transition is not None
        task = _of_transition(states, transition, end, min_robustness, max_torque_ratio, tasks)
    console = Console(soft_wrap=True)
    with StageBars(console) as bars:
        data = load_robot_data(robot, bars.robot_data)
    setting = posture_setting(data, given.scene(), given.request.gravity)
    found = generate_posture(setting, task.problem, task.start, replace(THOROUGH, qp_solver=solver))
    if isinstance(found, Failure):
        console.print(f"{task.name}: not found: {failure_text(found)}", markup=False)
        raise click.exceptions.Exit(1)
    console.print(f"{task.name}: found", markup=False)
    for line in _lines(setting, task, found):
        console.print(line, markup=False, highlight=False)
    _write(_plan_of(found, given, setting), out, page, picture)


def _of_state(
    states: Sequence[State],
    index: int,
    min_robustness: float,
    max_torque_ratio: float | None,
    tasks: Sequence[Constraint],
) -> Task:
    """The problem of a state on all its contacts."""
    state = states[_index("state", index, len(states))]
    problem = PostureProblem(
        contacts=state.contacts,
        supporting=state.contacts,
        min_robustness=min_robustness,
        max_torque_ratio=max_torque_ratio,
        tasks=tuple(tasks),
    )
    return Task(f"posture of state {index}", problem, state.q)


def _of_transition(
    states: Sequence[State],
    index: int,
    end: str | None,
    min_robustness: float,
    max_torque_ratio: float | None,
    tasks: Sequence[Constraint],
) -> Task:
    """The problem of a witness of a transition."""
    first = _index("transition", index, len(states) - 1)
    transition = Transition.between(states[first], states[first + 1])
    if not ENDS[transition.action]:
        raise InvalidInput("transition", index, "changes no contact")
    chosen = ENDS[transition.action][0] if end is None else WitnessEnd(end)
    problem, start = witness_problem(transition, chosen, min_robustness, max_torque_ratio, tasks)
    return Task(f"witness of transition {index} at {chosen}", problem, start)


def _index(field: str, value: int, count: int) -> int:
    """An index, checked."""
    if not 0 <= value < count:
        known = f"must lie in [0, {count - 1}]" if count > 0 else "the plan has none"
        raise InvalidInput(field, value, known)
    return value


def _lines(setting: PostureSetting, task: Task, found: State) -> list[str]:
    """Lines of text on a posture."""
    robot = setting.body.robot
    carrying = task.problem.supporting
    quality = posture_quality(PostureModel(setting), found, carrying)
    moved = float(np.linalg.norm(found.q[:3] - task.start[:3]))
    return [
        f"contacts: {_names(found.contacts, setting)}, within {1e3 * quality.contact_error:.4f} mm",
        f"robustness: {quality.robustness:.2f} N on {_names(carrying, setting)}",
        f"torque ratio: {quality.balance.ratio:.2f}, joint {quality.balance.joint}",
        f"joint limits: {quality.joint_margin:.3f} left, joint {quality.joint}",
        _clearance_line(quality),
        f"root of {robot.name} moved by {1e3 * moved:.0f} mm",
    ]


def _names(contacts: Sequence[Contact], setting: PostureSetting) -> str:
    names = [setting.body.robot.limbs[contact.limb].name for contact in contacts]
    return ", ".join(names) if names else "no limb"


def _clearance_line(quality: PostureQuality) -> str:
    if quality.clearance >= REACH:
        return f"clearance: more than {1e3 * REACH:.0f} mm"
    first, second = quality.bodies
    return f"clearance: {1e3 * quality.clearance:.1f} mm, {first} and {second or 'environment'}"


def _plan_of(found: State, given: PlanningInput, setting: PostureSetting) -> ContactPlan:
    """A plan with a posture as its only state; start and goal are where its root is."""
    robot, stability = given.robot, setting.body.stability
    whole = replace(found, robustness=stability.b0(found.contacts, found.com))
    entry = state_entry(robot, whole)
    plan = bare_plan([entry], given.request, robot)
    place = {"start": entry.root, "goal": entry.root}
    threshold = min(plan.request.robustness_threshold, entry.robustness)
    request = plan.request.model_copy(update=place | {"robustness_threshold": threshold})
    return plan.model_copy(update={"environment": given.environment, "request": request})


def _write(plan: ContactPlan, out: Path | None, page: Path | None, picture: Path | None) -> None:
    """Write the files that were requested."""
    if out is not None:
        plan.write(out)
        click.echo(f"written to {out}")
    if page is not None:
        from rbprm_core.view.page import write_page

        write_page(plan, page)
        click.echo(f"written to {page}")
    if picture is not None:
        from rbprm_core.view.picture import write_picture

        write_picture(plan, picture)
        click.echo(f"written to {picture}")
