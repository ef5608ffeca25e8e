"""Measure the planner's node as a process that is reached over DDS, as on a robot.

    scripts/in_workspace.sh .venv/bin/python scripts/measure_node.py edits --count 100

The output is Markdown; `--help` lists the measurements. Times are those of a client: from before a
message or call is sent until the answer has arrived and is read.
"""

from __future__ import annotations

import argparse
import itertools
import os
import random
import signal
import statistics
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path

import numpy as np
from node_soak import count_answers, print_memory, soak
from planner_session import (
    COLUMNS,
    GOAL,
    INNER,
    ISLAND,
    TIMEOUT,
    Reaction,
    Session,
    field,
    planner,
    tile,
    way,
)
from rbprm_msgs.msg import PlanningResult, Surface
from rbprm_msgs.srv import Plan
from rclpy.utilities import get_rmw_implementation_identifier

from rbprm_core.check import check_plan
from rbprm_core.environment import polygon_entry
from rbprm_core.scenario import Scenario, load_scenario
from rbprm_core.scene import Scene
from rbprm_ros.conversions import plan_of_messages, request_message
from rbprm_ros.demo.perception import Perception
from rbprm_ros.rclpy_utils.qos import CALLS

ENDLESS = ("guide.rrt.iterations:=100000000",)  # so that only the time limit ends a search


def tile_ahead(session: Session, chance: random.Random) -> str:
    """A tile on which a later state stands, and the executed state does not."""
    first, *ahead = session.client.sequence.states
    under = {contact.surface_id for contact in first.contacts}
    found = {contact.surface_id for state in ahead for contact in state.contacts} - under
    return chance.choice(sorted(found & {f"0/{column}" for column in INNER}))


def seconds_of(act: Callable[[], object]) -> float:
    """Duration of a call, seconds."""
    start = time.perf_counter()
    act()
    return time.perf_counter() - start


def print_times(what: str, seconds: Sequence[float], bar: float | None = None) -> None:
    """Print a row of the table of times.

    Args:
        what: name of the times.
        seconds: the times, seconds.
        bar: limit of their median, seconds; None for none.
    """
    if not seconds:
        print(f"| {what} | 0 | - | - | - | |")
        return
    times = (statistics.median(seconds), np.percentile(seconds, 95), max(seconds))
    shown = " | ".join(f"{1e3 * value:.1f} ms" for value in times)
    text = "" if bar is None else f"{1e3 * bar:.0f} ms: {'met' if times[0] <= bar else 'MISSED'}"
    print(f"| {what} | {len(seconds)} | {shown} | {text} |", flush=True)


def print_head() -> None:
    """Print the head of the table of times."""
    print("\n| | n | median | 95 % | worst | bar on the median |")
    print("|---|---|---|---|---|---|", flush=True)


def measure_edits(options: argparse.Namespace) -> None:
    """Talos executes a plan while surfaces change: time from edit to INVALIDATED, and to the
    revision."""
    scenario = load_scenario("replanning")
    with planner(scenario.robot) as session:
        walks = (walk(session, scenario, seed) for seed in itertools.count())
        edits = itertools.chain.from_iterable(walks)
        played = list(itertools.islice(edits, options.count))
    reactions = [reaction for reaction, _ in played]
    print_head()
    invalidated = [r.invalidated for r in reactions if r.invalidated is not None]
    print_times("edit to INVALIDATED", invalidated)
    print_times("edit to revision", [r.revised for r in reactions if r.revised is not None])
    failed = sum(reaction.failed for reaction in reactions)
    print(
        f"\n{len(played)} edits: the plan stayed valid at {len(played) - len(invalidated)}, ",
        end="",
    )
    clean = sum(not violations for _, violations in played)
    print(f"{failed} without a revision; {clean} without violations in the remaining states")
    for violation in itertools.chain.from_iterable(violations for _, violations in played):
        print(f"- {violation}")


def walk(
    session: Session, scenario: Scenario, seed: int
) -> Iterator[tuple[Reaction, tuple[str, ...]]]:
    """The edits of one walk: the reaction to each, and the violations of the remaining states."""
    perception = Perception(session.node, scenario, session.name, "map")
    session.wait(perception.has_subscriber, "subscriber of the surfaces")
    session.publish_environment(perception.publish_all)
    request = scenario.request_for(scenario.load_robot(), seed)
    session.plan(request_message(request, scenario.robot, scenario.request.time_limit))
    scene = scenario.scene()
    for k, edit in enumerate(scenario.edits):
        count = len(session.client.sequence.states)
        session.execute(max(session.executed, int(edit.at * count)))
        scene = scenario.edited(scene, k)
        session.version += 1
        reaction = session.react(lambda edit=edit: perception.publish_edit(edit))
        yield reaction, () if reaction.failed else faults(session, scene)
        if reaction.failed:
            return


def faults(session: Session, scene: Scene) -> tuple[str, ...]:
    """Violations of the remaining states in the edited environment."""
    plan = plan_of_messages(session.client.sequence, session.guide, polygon_entry(scene, "edited"))
    rest = plan.states[session.executed :]
    request = plan.request.model_copy(update={"start": rest[0].root})
    report = check_plan(plan.model_copy(update={"states": rest, "request": request}))
    return tuple(str(violation) for violation in report.violations)


def measure_status(options: argparse.Namespace) -> None:
    """Many surfaces; one under a later state is removed: time from message to INVALIDATED."""
    surfaces, chance = field(options.surfaces), random.Random(0)
    with planner() as session:
        session.publish_environment(lambda: session.send(*surfaces.values(), is_diff=False))
        session.plan(way(GOAL))
        reactions = []
        for _ in range(options.count):
            lost = tile_ahead(session, chance)
            reactions.append(session.react(lambda lost=lost: session.send(removed=[lost])))
            session.send(surfaces[lost])
            session.settle()
    invalidated = [r.invalidated for r in reactions if r.invalidated is not None]
    print_head()
    print_times(f"edit to INVALIDATED, {len(surfaces)} surfaces", invalidated, 0.05)
    print_times("edit to revision", [r.revised for r in reactions if r.revised is not None])


def measure_load(options: argparse.Namespace) -> None:
    """Answers, statuses and accepted surfaces while planning keeps a core busy."""
    surfaces, chance = field(options.surfaces), random.Random(0)
    with planner(parameters=ENDLESS) as session:
        session.publish_environment(lambda: session.send(*surfaces.values(), is_diff=False))
        session.plan(way(GOAL))
        print_head()
        client, count = session.client, options.count
        for what, ask, bar in (
            ("~/validate", client.validate, 0.05),
            ("~/get_environment", client.environment, None),
        ):
            print_times(what, under_load(session, lambda ask=ask: seconds_of(ask), count), bar)
        restored: list[float] = []
        lost = partial(lose, session, surfaces, chance, restored)
        print_times("loss to INVALIDATED", under_load(session, lost, options.edits))
        print_times("its return to a status without invalid states", restored)
        call = session.search()
        sent, accepted = stream(session, options.rate, options.seconds)
        busy = "" if not call.done else ", the last of them after the plan had ended"
        print(f"\n{accepted} of {sent} messages at {options.rate:g} Hz accepted{busy}")


def under_load(session: Session, measure: Callable[[], float], count: int) -> list[float]:
    """Measurements that begin while the planner searches."""
    seconds: list[float] = []
    call = session.search()
    while len(seconds) < count:
        if call.done:
            call = session.search()
        seconds.append(measure())
    call.cancel()
    call.result(TIMEOUT)
    return seconds


def lose(
    session: Session, surfaces: dict[str, Surface], chance: random.Random, restored: list[float]
) -> float:
    """Remove a tile under a later state and put it back.

    Args:
        session: the planner.
        surfaces: all tiles by id.
        chance: random numbers.
        restored: receives the seconds from the tile's return to a status without invalid states.

    Returns:
        Seconds from the tile's loss to INVALIDATED.
    """
    lost, count, start = tile_ahead(session, chance), len(session.statuses), time.perf_counter()
    session.send(removed=[lost])
    session.wait(lambda: session.time_of_status(count) is not None, "INVALIDATED")
    back = time.perf_counter()
    session.send(surfaces[lost])
    session.wait(
        lambda: not session.client.status.invalid_states, "a status without invalid states"
    )
    restored.append(time.perf_counter() - back)
    return session.time_of_status(count) - start


def stream(session: Session, rate: float, seconds: float) -> tuple[int, int]:
    """Publish changes of surfaces at a constant rate; returns how many were sent, and accepted.

    The planner's version of the environment counts the accepted changes.
    """
    before, count = session.client.environment().environment_version, round(rate * seconds)
    start = time.perf_counter()
    for k in range(count):
        session.spinner.spin_until(lambda: False, start + k / rate - time.perf_counter())
        session.send(tile("moving", 100.0 + 0.01 * k, 0.0))
    session.version = before + count
    session.spinner.spin_until(
        lambda: session.client.environment().environment_version >= session.version, 5.0
    )
    return count, session.client.environment().environment_version - before


def measure_cancel(options: argparse.Namespace) -> None:
    """While a guide path is searched: time from cancellation to result, and beyond a time limit."""
    surfaces, limit = field(COLUMNS), 1.0
    with planner(parameters=ENDLESS) as session:
        session.publish_environment(lambda: session.send(*surfaces.values(), is_diff=False))
        print_head()
        for what, end, bar in (
            ("cancel to result", cancelled, 0.1),
            (f"over a time limit of {limit:g} s", limited, 0.1),
        ):
            print_times(what, [end(session, limit) for _ in range(options.count)], bar)


def cancelled(session: Session, _limit: float) -> float:
    """Seconds from cancellation to result."""
    call, start = session.search(), time.perf_counter()
    call.cancel()
    require(call.result(TIMEOUT).result, PlanningResult.CANCELLED)
    return time.perf_counter() - start


def limited(session: Session, limit: float) -> float:
    """Seconds from a goal to its result, beyond its time limit."""
    start = time.perf_counter()
    call = session.client.plan(way(ISLAND, limit))
    require(call.result(TIMEOUT).result, PlanningResult.TIME_LIMIT)
    return time.perf_counter() - start - limit


def require(result: PlanningResult, code: int) -> None:
    """Raise an error where a result has another code than expected."""
    if result.code != code:
        raise RuntimeError(f"code {result.code} in place of {code}: {result.text}")


def measure_sigterm(options: argparse.Namespace) -> None:
    """SIGTERM under load: exit code, answer to the goal under way, remaining processes."""
    surfaces, seconds = field(COLUMNS), []
    counters: Counter[str] = Counter()
    for _ in range(options.count):
        with planner(parameters=ENDLESS) as session:
            session.publish_environment(lambda: session.send(*surfaces.values(), is_diff=False))
            call, workers = session.search(), session.workers().values()
            start = time.perf_counter()
            session.process.send_signal(signal.SIGTERM)
            while session.process.poll() is None and time.perf_counter() < start + TIMEOUT:
                session.spinner.spin_until(lambda: False, 0.005)
            seconds.append(time.perf_counter() - start)
            session.spinner.spin_until(lambda: call.done, 1.0)  # noqa: B023
            counters["exit code 0"] += session.process.poll() == 0
            code = call.result(0.0).result.code if call.done else None
            counters["goal answered with CANCELLED"] += code == PlanningResult.CANCELLED
            counters["no process left"] += not any(Path(f"/proc/{pid}").exists() for pid in workers)
    print_head()
    print_times("SIGTERM to the end", seconds)
    print("\n" + "; ".join(f"{what}: {n} of {options.count}" for what, n in counters.items()))


def measure_soak(options: argparse.Namespace) -> None:
    """Surfaces that change permanently and plans one after another: answers and memory."""
    surfaces = field(COLUMNS)
    with planner() as session:
        session.publish_environment(lambda: session.send(*surfaces.values(), is_diff=False))
        session.plan(way(GOAL))
        service = session.node.create_client(Plan, f"{session.name}/plan", qos_profile=CALLS)
        session.wait(service.service_is_ready, "the plan service")
        answers, known, before = count_answers(service), len(session.sequences), session.version
        print("\n| minute | node | planning | validating | all, MB |\n|---|---|---|---|---|")
        futures, seconds = soak(session, surfaces, service, options)
        print_memory(session, "end")
        session.wait_for_environment()
    print_head()
    print_times("~/plan", seconds)
    codes = Counter(future.result().result.code for future in futures if future.done())
    published, twice = len(session.sequences) - known, sum(n > 1 for n in answers.values())
    planned = codes[PlanningResult.SUCCESS]
    print(f"\n{session.version - before} edits, all accepted; {published} sequences", end="")
    print(f" received, {planned} of them requested; {len(futures)} plans requested, ", end="")
    print(f"{len(futures) - len(answers)} lost, {twice} answered twice; by code: {dict(codes)}")


def parser() -> argparse.ArgumentParser:
    """The command line."""
    made = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    commands = made.add_subparsers(required=True, metavar="MEASUREMENT")
    measurements: tuple[tuple[Callable[..., None], dict[str, float]], ...] = (
        (measure_edits, {"count": 100}),
        (measure_status, {"surfaces": 200, "count": 50}),
        (measure_load, {"surfaces": 200, "count": 100, "edits": 20, "rate": 30.0, "seconds": 10.0}),
        (measure_cancel, {"count": 20}),
        (measure_sigterm, {"count": 20}),
        (measure_soak, {"minutes": 10.0, "rate": 10.0, "period": 1.0}),
    )
    for measure, defaults in measurements:
        name = measure.__name__.removeprefix("measure_")
        command = commands.add_parser(name, help=measure.__doc__)
        command.set_defaults(measure=measure, name=name)
        for option, default in defaults.items():
            command.add_argument(f"--{option}", type=type(default), default=default)
    return made


def main() -> None:
    """Measure, and print the duration and the machine's load."""
    options = parser().parse_args()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # the planner ends with this process
    before = os.getloadavg()[0]
    start = time.perf_counter()
    options.measure(options)
    rmw, after = get_rmw_implementation_identifier(), os.getloadavg()[0]
    took = f"{time.perf_counter() - start:.0f} s"
    print(f"\n{took}; {os.cpu_count()} cores, load {before:.1f} before, {after:.1f} after; {rmw}")


if __name__ == "__main__":
    main()
