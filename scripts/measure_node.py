"""Measure the planner's node: a process of its own, asked and told by DDS as on a robot.

    scripts/in_workspace.sh .venv/bin/python scripts/measure_node.py edits --count 100

Prints Markdown; `--help` lists the measurements. Times are those that a client sees: from before a
message or a call leaves it until what it waits for has arrived and was read.
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
from typing import Any

import numpy as np
from planner_session import (
    COLUMNS,
    GOAL,
    GRACE,
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
from rclpy.client import Client
from rclpy.utilities import get_rmw_implementation_identifier

from rbprm_core.check import check_plan
from rbprm_core.environment import polygon_entry
from rbprm_core.scenario import Scenario, load_scenario
from rbprm_core.scene import Scene
from rbprm_ros.conversions import plan_of_messages, request_message
from rbprm_ros.demo.perception import Perception
from rbprm_ros.rclpy_utils.qos import CALLS

ENDLESS = ("guide.rrt.iterations:=100000000",)  # only the time limit ends a search


def tile_ahead(session: Session, chance: random.Random) -> str:
    """A tile that a state to come stands on, and the robot does not."""
    first, *ahead = session.client.sequence.states
    under = {contact.surface_id for contact in first.contacts}
    found = {contact.surface_id for state in ahead for contact in state.contacts} - under
    return chance.choice(sorted(found & {f"0/{column}" for column in INNER}))


def seconds_of(act: Callable[[], object]) -> float:
    """How long something takes."""
    start = time.perf_counter()
    act()
    return time.perf_counter() - start


def print_times(what: str, seconds: Sequence[float], bar: float | None = None) -> None:
    """A row of the table of times; `bar` is on the median, seconds."""
    if not seconds:
        print(f"| {what} | 0 | - | - | - | |")
        return
    times = (statistics.median(seconds), np.percentile(seconds, 95), max(seconds))
    shown = " | ".join(f"{1e3 * value:.1f} ms" for value in times)
    text = "" if bar is None else f"{1e3 * bar:.0f} ms: {'met' if times[0] <= bar else 'MISSED'}"
    print(f"| {what} | {len(seconds)} | {shown} | {text} |", flush=True)


def print_head() -> None:
    """The head of the table of times."""
    print("\n| | n | median | 95 % | worst | bar on the median |")
    print("|---|---|---|---|---|---|", flush=True)


def measure_edits(options: argparse.Namespace) -> None:
    """A walk of Talos while surfaces change: edit to INVALIDATED and to the revision, checked."""
    scenario = load_scenario("replanning")
    with planner(scenario.robot) as session:
        walks = (walk(session, scenario, seed) for seed in itertools.count())
        edits = itertools.chain.from_iterable(walks)
        played = list(itertools.islice(edits, options.count))
    reactions = [reaction for reaction, _ in played]
    print_head()
    told = [r.invalidated for r in reactions if r.invalidated is not None]
    print_times("edit to INVALIDATED", told)
    print_times("edit to revision", [r.revised for r in reactions if r.revised is not None])
    failed = sum(reaction.failed for reaction in reactions)
    print(f"\n{len(played)} edits: the plan stood at {len(played) - len(told)}, ", end="")
    clean = sum(not violations for _, violations in played)
    print(f"{failed} without a revision; {clean} clean by the check of what is left to be walked")
    for violation in itertools.chain.from_iterable(violations for _, violations in played):
        print(f"- {violation}")


def walk(
    session: Session, scenario: Scenario, seed: int
) -> Iterator[tuple[Reaction, tuple[str, ...]]]:
    """The edits of one walk: what came of each, and what the check says against the rest."""
    perception = Perception(session.node, scenario, session.name, "map")
    session.wait(perception.heard, "subscriber of the surfaces")
    session.see(perception.publish_all)
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
    """Violations of what is left to be walked, in the environment as edited."""
    plan = plan_of_messages(session.client.sequence, session.guide, polygon_entry(scene, "edited"))
    rest = plan.states[session.executed :]
    request = plan.request.model_copy(update={"start": rest[0].root})
    report = check_plan(plan.model_copy(update={"states": rest, "request": request}))
    return tuple(str(violation) for violation in report.violations)


def measure_status(options: argparse.Namespace) -> None:
    """Many surfaces, one under a state to come removed: message to INVALIDATED."""
    surfaces, chance = field(options.surfaces), random.Random(0)
    with planner() as session:
        session.see(lambda: session.send(*surfaces.values(), is_diff=False))
        session.plan(way(GOAL))
        reactions = []
        for _ in range(options.count):
            lost = tile_ahead(session, chance)
            reactions.append(session.react(lambda lost=lost: session.send(removed=[lost])))
            session.send(surfaces[lost])
            session.settle()
    told = [r.invalidated for r in reactions if r.invalidated is not None]
    print_head()
    print_times(f"edit to INVALIDATED, {len(surfaces)} surfaces", told, 0.05)
    print_times("edit to revision", [r.revised for r in reactions if r.revised is not None])


def measure_load(options: argparse.Namespace) -> None:
    """Answers, statuses and surfaces while a plan keeps a core busy."""
    surfaces, chance = field(options.surfaces), random.Random(0)
    with planner(parameters=ENDLESS) as session:
        session.see(lambda: session.send(*surfaces.values(), is_diff=False))
        session.plan(way(GOAL))
        print_head()
        client, count = session.client, options.count
        for what, ask, bar in (
            ("~/validate", client.validate, 0.05),
            ("~/get_environment", client.environment, None),
        ):
            print_times(what, under_load(session, lambda ask=ask: seconds_of(ask), count), bar)
        mended: list[float] = []
        lost = partial(lose, session, surfaces, chance, mended)
        print_times("loss to INVALIDATED", under_load(session, lost, options.edits))
        print_times("its mending to a status without lost states", mended)
        call = session.search()
        sent, taken = stream(session, options.rate, options.seconds)
        busy = "" if not call.done else ", the last of them after the plan had ended"
        print(f"\n{taken} of {sent} messages at {options.rate:g} Hz taken in{busy}")


def under_load(session: Session, measure: Callable[[], float], count: int) -> list[float]:
    """Some measurements, each begun while the planner searches."""
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
    session: Session, surfaces: dict[str, Surface], chance: random.Random, mended: list[float]
) -> float:
    """Remove a tile ahead and put it back.

    Args:
        mended: gets the seconds from the tile's return to a status without lost states.

    Returns:
        Seconds from its loss to INVALIDATED.
    """
    lost, told, start = tile_ahead(session, chance), len(session.statuses), time.perf_counter()
    session.send(removed=[lost])
    session.wait(lambda: session.told_since(told) is not None, "INVALIDATED")
    back = time.perf_counter()
    session.send(surfaces[lost])
    session.wait(lambda: not session.client.status.invalid_states, "a status without lost states")
    mended.append(time.perf_counter() - back)
    return session.told_since(told) - start


def stream(session: Session, rate: float, seconds: float) -> tuple[int, int]:
    """Surfaces at a steady rate, each a change: how many were sent, and how many taken in.

    The planner's version of the environment counts the changes that it took in.
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
    """Cancel to result, and answers after a time limit, while a guide is searched."""
    surfaces, limit = field(COLUMNS), 1.0
    with planner(parameters=ENDLESS) as session:
        session.see(lambda: session.send(*surfaces.values(), is_diff=False))
        print_head()
        for what, end, bar in (
            ("cancel to result", cancelled, 0.1),
            (f"over a time limit of {limit:g} s", limited, 0.1),
        ):
            print_times(what, [end(session, limit) for _ in range(options.count)], bar)


def cancelled(session: Session, _limit: float) -> float:
    """Seconds from the wish to stop to the result."""
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
    """Refuse to measure what ended in another way than it was to."""
    if result.code != code:
        raise RuntimeError(f"code {result.code} in place of {code}: {result.text}")


def measure_sigterm(options: argparse.Namespace) -> None:
    """SIGTERM under load: exit code, answer to the goal under way, processes left behind."""
    surfaces, seconds = field(COLUMNS), []
    counters: Counter[str] = Counter()
    for _ in range(options.count):
        with planner(parameters=ENDLESS) as session:
            session.see(lambda: session.send(*surfaces.values(), is_diff=False))
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
    """Surfaces that change all the time and plans one after another: answers and memory."""
    surfaces = field(COLUMNS)
    with planner() as session:
        session.see(lambda: session.send(*surfaces.values(), is_diff=False))
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
    print(f"\n{session.version - before} edits, all taken in; {published} sequences", end="")
    print(f" received, {planned} of them asked for; {len(futures)} plans asked for, ", end="")
    print(f"{len(futures) - len(answers)} lost, {twice} answered twice; by code: {dict(codes)}")


def soak(
    session: Session, surfaces: dict[str, Surface], service: Client, options: argparse.Namespace
) -> tuple[list[Any], list[float]]:
    """Edit and ask until the time is over; returns the calls, and the seconds of the answers."""
    futures: list[Any] = []
    seconds: list[float] = []
    columns, minutes = itertools.cycle(INNER), itertools.count()
    start, minute, asked = time.perf_counter(), next(minutes), -np.inf
    for k in range(round(60.0 * options.minutes * options.rate)):
        session.spinner.spin_until(lambda: False, start + k / options.rate - time.perf_counter())
        if k % 2 == 0:
            lost = f"0/{next(columns)}"
            session.send(removed=[lost])
        else:
            session.send(surfaces[lost])
        now = time.perf_counter()
        if len(seconds) == len(futures) and now - asked >= options.period:
            asked = now
            futures.append(service.call_async(way(GOAL, 10.0)))
            futures[-1].add_done_callback(
                lambda _, asked=now: seconds.append(time.perf_counter() - asked)
            )
        if now - start >= 60.0 * minute:
            print_memory(session, str(minute))
            minute = next(minutes)
    session.spinner.spin_until(lambda: len(seconds) == len(futures), TIMEOUT)
    session.spinner.spin_until(lambda: False, GRACE)  # for second answers
    return futures, seconds


def count_answers(service: Client) -> Counter[int]:
    """Answers that a client takes, by the number of the call; rclpy drops a second one unseen."""
    answers: Counter[int] = Counter()
    pending = service.get_pending_request

    def counted(number: int) -> Any:
        answers[number] += 1
        return pending(number)

    service.get_pending_request = counted
    return answers


def print_memory(session: Session, when: str) -> None:
    """A row of the table of resident memory."""
    workers = session.workers()
    ids = (session.process.pid, workers.get("planning"), workers.get("validating"))
    sizes = [0.0 if pid is None else resident(pid) for pid in ids]
    shown = " | ".join(f"{size:.1f}" for size in (*sizes, sum(sizes)))
    print(f"| {when} | {shown} |", flush=True)


def resident(pid: int) -> float:
    """Resident memory of a process, MB."""
    lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmRSS:")) / 1024


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
    """Measure, and tell on what."""
    options = parser().parse_args()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # its end is the planner's too
    before = os.getloadavg()[0]
    start = time.perf_counter()
    options.measure(options)
    rmw, after = get_rmw_implementation_identifier(), os.getloadavg()[0]
    took = f"{time.perf_counter() - start:.0f} s"
    print(f"\n{took}; {os.cpu_count()} cores, load {before:.1f} before, {after:.1f} after; {rmw}")


if __name__ == "__main__":
    main()
