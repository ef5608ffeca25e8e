"""The example executive executes a plan of Talos over stairs and stones while surfaces change."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from nav_msgs.msg import Path
from rbprm_msgs.msg import ContactSequence, ExecutionState, PlannerStatus, SurfaceArray

from rbprm_core.check import check_plan
from rbprm_core.environment import polygon_entry
from rbprm_core.scenario import Scenario, load_scenario
from rbprm_ros.conversions import plan_of_messages
from rbprm_ros.rclpy_utils.qos import LATCHED_STREAM, STREAM

if TYPE_CHECKING:
    from conftest import Executive, Site

NODE = "/rbprm_planner"


@dataclass
class Heard:
    """The messages that an observer receives, each with its time of arrival."""

    surfaces: list[tuple[float, SurfaceArray]] = field(default_factory=list)
    sequences: list[tuple[float, ContactSequence]] = field(default_factory=list)
    statuses: list[tuple[float, PlannerStatus]] = field(default_factory=list)
    executed: list[tuple[float, ExecutionState]] = field(default_factory=list)

    @classmethod
    def on(cls, onlooker: Executive) -> Heard:
        """Subscribe to all topics."""
        heard = cls()
        for kind, topic, kept, qos in (
            (SurfaceArray, "surfaces", heard.surfaces, STREAM),
            (ContactSequence, "contact_sequence", heard.sequences, LATCHED_STREAM),
            (PlannerStatus, "status", heard.statuses, LATCHED_STREAM),
            (ExecutionState, "execution_state", heard.executed, STREAM),
        ):
            onlooker.node.create_subscription(kind, f"{NODE}/{topic}", timed(kept), qos)
        return heard


def timed(kept: list[Any]) -> Callable[[Any], None]:
    """A callback that keeps messages and their times of arrival."""
    return lambda message: kept.append((time.monotonic(), message))


def violations(scenario: Scenario, edits: int, sequence: ContactSequence, first: int) -> list[str]:
    """Violations that the check finds in a sequence from a state on, after a number of edits."""
    scene = scenario.scene()
    for k in range(edits):
        scene = scenario.edited(scene, k)
    plan = plan_of_messages(sequence, Path(), polygon_entry(scene, scenario.name))
    # The remaining states, from the executed one on.
    rest = plan.states[first:]
    request = plan.request.model_copy(update={"start": rest[0].root})
    left = plan.model_copy(update={"states": rest, "request": request})
    return [str(violation) for violation in check_plan(left).violations]


def test_walks_on_with_the_revisions(site: Site) -> None:
    onlooker = site.executive()
    heard = Heard.on(onlooker)
    executive = site.start("executive", "--ros-args", "-p", "rate:=25.0")
    # The planner starts last: the executive waits for it, and the observer misses nothing.
    sender = f"{NODE}/surfaces"
    onlooker.spin_until(lambda: onlooker.node.count_publishers(sender) > 0, "executive")
    planner = site.start("planner_node", "--ros-args", "-p", "robot:=talos")
    onlooker.spin_until(lambda: executive.popen.poll() is not None, "end of the walk", 180.0)
    log = executive.log.read_text()
    assert executive.popen.returncode == 0, log
    assert "at the goal" in log
    assert planner.stop() == 0, planner.log.read_text()

    scenario = load_scenario("replanning")
    sequences = [sequence for _, sequence in heard.sequences if sequence.states]
    assert [sequence.revision for sequence in sequences] == [0, 1, 2, 3]
    assert len({sequence.sequence_id for sequence in sequences}) == 1
    assert all(sequence.complete for sequence in sequences)
    edits = [(at, surfaces) for at, surfaces in heard.surfaces if surfaces.is_diff]
    assert len(edits) == len(scenario.edits)

    pairs = zip(edits, itertools.pairwise(sequences), strict=True)
    for edit, ((sent, _), (before, after)) in enumerate(pairs):
        # Executed states, and the states before the first changed one, stay as they were.
        first = after.first_changed_state
        assert 0 < first < len(after.states)
        assert after.states[:first] == before.states[:first]
        assert after.states[first] != before.states[first]
        told = [(at, status) for at, status in heard.statuses if at > sent]
        invalidated = next(status for _, status in told if status.state == status.INVALIDATED)
        assert invalidated.revision == before.revision
        assert 0 < invalidated.valid_states == invalidated.invalid_states[0].index
        assert first <= invalidated.valid_states
        assert invalidated.executed_state < first
        assert violations(scenario, edit + 1, after, invalidated.executed_state) == []
        states = [state for state, _ in itertools.groupby(status.state for _, status in told)]
        begun = states.index(PlannerStatus.INVALIDATED)  # VALID first, after a reported state
        assert states[:begun] in ([], [PlannerStatus.VALID])
        assert states[begun : begun + 3] == [
            PlannerStatus.INVALIDATED,
            PlannerStatus.REPLANNING,
            PlannerStatus.VALID,
        ]
        to_status = next(at for at, s in told if s.state == s.INVALIDATED) - sent
        to_revision = next(at for at, s in heard.sequences if s.revision == after.revision) - sent
        # Printed only, since a busy machine exceeds any limit; see scripts/measure_node.py.
        print(f"edit {edit}: {1e3 * to_status:.0f} ms, revision {1e3 * to_revision:.0f} ms")

    # State by state through the revisions, up to the end of the last one.
    steps = [(step.revision, step.state) for _, step in heard.executed]
    assert steps == sorted(steps)
    visited = list(dict.fromkeys(state for _, state in steps))
    assert visited == list(range(visited[0], len(sequences[-1].states)))
    assert visited[0] < sequences[1].first_changed_state


def test_scenario_that_cannot_be_used_is_told(site: Site) -> None:
    executive = site.start("executive", "--ros-args", "-p", "scenario:=nowhere")
    assert executive.popen.wait(60.0) == 2
    assert "scenario = 'nowhere'" in executive.log.read_text()


def test_without_a_planner_it_ends_with_an_error(site: Site) -> None:
    executive = site.start("executive", "--ros-args", "-p", "timeout:=0.5")
    assert executive.popen.wait(60.0) == 1
    assert "no planner /rbprm_planner; is it started" in executive.log.read_text()


def test_waits_for_the_surfaces_of_others(site: Site) -> None:
    site.planner()
    quiet = ("-p", "surfaces:=false", "-p", "edits:=false")
    executive = site.start("executive", "--ros-args", "-p", "scenario:=flat", *quiet)
    onlooker = site.executive()
    topic = f"{NODE}/execution_state"
    onlooker.spin_until(lambda: onlooker.node.count_publishers(topic) > 0, "executive")
    time.sleep(1.0)  # in which the executive must neither end nor plan without surfaces
    assert executive.popen.poll() is None, executive.log.read_text()
    assert "plan of" not in executive.log.read_text()
    site.start("publish_surfaces", "flat")
    executive.wait_for("plan of")
