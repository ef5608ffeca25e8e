"""`rbprm plan`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import click
import numpy as np
from rich.console import Console
from rich.table import Table

from rbprm_core.budget import MIN_TIME_LIMIT, Budget
from rbprm_core.check import CheckReport, check_plan, figures
from rbprm_core.cli.progress import StageBars
from rbprm_core.contacts.registry import CONTACT_PLANNERS
from rbprm_core.errors import InvalidInput
from rbprm_core.guide.registry import GUIDE_PLANNERS
from rbprm_core.option_names import warn_renamed
from rbprm_core.plan_conversion.states_to_plan import contact_plan
from rbprm_core.plan_record import ContactPlan
from rbprm_core.plan_record.request_entry import MAX_TIME_LIMIT
from rbprm_core.planner import plan as plan_request
from rbprm_core.planning_input import (
    PlanningInput,
    input_from_plan,
    input_from_scenario,
    is_plan_file,
)
from rbprm_core.portfolio.portfolio import plan_portfolio
from rbprm_core.request import PlanRequest, StageNames
from rbprm_core.robot.data import load_robot_data
from rbprm_core.validation import finite_number


@click.command(short_help="Plan a scenario, and check the plan.")
@click.argument("scenario")
@click.option("--robot", help="A known robot, or a robot file; the scenario's own by default.")
@click.option("--seed", type=int, help="Seed of the random generator: 0 by default, or the plan's.")
@click.option(
    "--jobs",
    type=click.IntRange(min=1),
    default=1,
    show_default=True,
    help="Processes that plan with this seed and those after it at once; first success wins.",
)
@click.option(
    "--guide",
    type=click.Choice(sorted(GUIDE_PLANNERS.names())),
    help="Guide planner; the scenario's by default.",
)
@click.option(
    "--contacts",
    type=click.Choice(sorted(CONTACT_PLANNERS.names())),
    help="Contact planner; the scenario's by default.",
)
@click.option("--time-limit", type=float, help="Seconds; the scenario's by default.")
@click.option("--robustness", type=float, help="Least raw b0 in newtons instead of the scenario's.")
@click.option(
    "--accept-below-threshold",
    is_flag=True,
    help="Where no state reaches the threshold, accept the one with the largest b0 of at least 0.",
)
@click.option("--most-robust", "old_flag", is_flag=True, hidden=True)
@click.option("--out", type=click.Path(dir_okay=False, path_type=Path), help="Plan file to write.")
def plan(
    scenario: str,
    robot: str | None,
    seed: int | None,
    jobs: int,
    guide: str | None,
    contacts: str | None,
    time_limit: float | None,
    robustness: float | None,
    accept_below_threshold: bool,
    old_flag: bool,
    out: Path | None,
) -> None:
    """Plan SCENARIO, a known name or a scenario file, and check the plan.

    SCENARIO may be a plan file (.json), too, which is planned again from its own request, robot and
    environment: the same states, unless an option changes something.

    Robot data (workspaces, sample databases) are computed on a robot's first use and kept; the
    time limit starts after that. Of several jobs the plan names the seed that won; --seed with
    that one alone gives the same plan again.
    """
    if old_flag:
        warn_renamed("--most-robust", "--accept-below-threshold")
        accept_below_threshold = True
    if out is not None and not out.absolute().parent.is_dir():
        raise InvalidInput("out", str(out), "its folder does not exist")
    given = _input(scenario, robot, seed, robustness)
    model, request = given.robot, given.request
    limit = request.time_limit if time_limit is None else time_limit
    limit = finite_number("time_limit", limit, low=MIN_TIME_LIMIT, high=MAX_TIME_LIMIT)
    request = replace(request, time_limit=limit)
    request = _with_stages(request, guide, contacts)
    if accept_below_threshold:
        request = _accept_below_threshold(request)
    scene = given.scene()
    console = Console()
    with StageBars(console) as bars:
        data = load_robot_data(model, bars.robot_data)
        if jobs == 1:
            outcome = plan_request(request, data, scene, Budget(limit, report=bars.planning))
        else:
            request, outcome = plan_portfolio(request, data, scene, limit, jobs, bars.seed)
    result = contact_plan(outcome, request, model, given.environment)
    if out is not None:
        result.write(out)
    report = check_plan(result)
    console.print(summary(result, report))
    for violation in report.violations:
        console.print(str(violation), style="red", markup=False)
    console.print(f"written to {out}" if out else "not written; --out FILE keeps the plan")
    if not report.valid:
        raise click.exceptions.Exit(1)


def _input(
    scenario: str, robot: str | None, seed: int | None, robustness: float | None
) -> PlanningInput:
    """What is planned: a scenario, or the request of an earlier plan."""
    if not is_plan_file(scenario):
        return input_from_scenario(scenario, robot, seed or 0, robustness)
    if robot is not None:
        raise InvalidInput("robot", robot, "a plan is planned again for the robot that it names")
    return input_from_plan(ContactPlan.read(scenario), seed, robustness)


def _with_stages(request: PlanRequest, guide: str | None, contacts: str | None) -> PlanRequest:
    stages = request.stages
    chosen = StageNames(guide or stages.guide, contacts or stages.contacts)
    return replace(request, stages=chosen)


def _accept_below_threshold(request: PlanRequest) -> PlanRequest:
    generator = replace(request.options.generator, accept_below_threshold=True)
    return replace(request, options=replace(request.options, generator=generator))


def summary(result: ContactPlan, report: CheckReport) -> Table:
    """The plan and its check in a few rows."""
    seconds = result.statistics.time
    table = Table(title=f"{result.environment.name}: {result.robot.name}", show_header=False)
    phases = [f"{name} {seconds[name]:.3f}" for name in seconds if "." not in name]
    table.add_row("seconds", ", ".join(phases))
    changes = report.transitions
    table.add_row("seed", str(result.request.seed))
    table.add_row("states", f"{len(result.states)}, {changes} contact transitions")
    table.add_row("per transition", f"{1000 * seconds['total'] / max(changes, 1):.1f} ms")
    table.add_row("least robustness", _robustness(result))
    way = np.diff([node.position for node in result.guide], axis=0)
    table.add_row("guide", f"{np.linalg.norm(way, axis=1).sum():.2f} m")
    for name, text in figures(report).items():
        table.add_row(name, text)
    table.add_row("independent check", "valid" if report.valid else "INVALID")
    return table


def _robustness(result: ContactPlan) -> str:
    """The least b0 of a plan, and how many states are under the threshold."""
    threshold = result.request.robustness_threshold
    values = [state.robustness for state in result.states]
    text = f"{min(values):.3g} N (threshold {threshold:g} N)"
    under = sum(value < threshold for value in values)
    return f"{text}, {under} states under it, by accept_below_threshold" if under else text
