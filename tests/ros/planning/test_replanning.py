"""Validation and replanning of a published sequence when surfaces change."""

from __future__ import annotations

import os
import signal
from typing import TYPE_CHECKING

import pytest
from geometry_msgs.msg import Point
from rbprm_msgs.msg import (
    ContactSequence,
    ContactState,
    ExecutionState,
    InvalidState,
    PlannerStatus,
    PlanningResult,
    Surface,
    SurfaceArray,
)
from rbprm_msgs.srv import Plan, Replan
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter

from rbprm_core.check import check_plan
from rbprm_core.plan_record import EnvironmentEntry, SurfaceEntry
from rbprm_ros.conversions import plan_of_messages
from rbprm_ros.rclpy_utils.qos import CALLS

if TYPE_CHECKING:
    from conftest import Executive, Site

TOPIC = "/rbprm_planner/execution_state"
LENGTH = 0.25  # length of a tile, metres; HyQ can step over a missing one
COUNT = 18
FAR = "t13"  # a tile in the middle of the way
EXECUTED = 6  # reported executed state


def tile(name: str, low: float, y: float = 0.0) -> Surface:
    """A tile across the way, from a value of x on."""
    corners = ((low, -0.6), (low + LENGTH, -0.6), (low + LENGTH, 0.6), (low, 0.6))
    vertices = [Point(x=x, y=y + side, z=0.0) for x, side in corners]
    return Surface(id=name, vertices=vertices, friction=0.5)


def way_to(x: float) -> Plan.Request:
    """A request for a goal on the tiles."""
    request = Plan.Request(robustness_threshold=10.0)
    request.start.pose.position.z = request.goal.pose.position.z = 0.6
    request.goal.pose.position.x = x
    return request


TILES = [tile(f"t{i}", -0.75 + LENGTH * i) for i in range(COUNT)]


class Walk:
    """A published sequence of HyQ over a row of tiles, of which some states are executed."""

    def __init__(self, executive: Executive) -> None:
        self.executive = executive
        self._execution = executive.node.create_publisher(ExecutionState, TOPIC, CALLS)
        limit = Parameter("replanning.time_limit", value=1.0).to_parameter_msg()
        executive.ask(SetParameters, "set_parameters", SetParameters.Request(parameters=[limit]))
        executive.publish(SurfaceArray(surfaces=TILES))
        executive.spin_until(lambda: executive.known() == {t.id for t in TILES}, "the tiles")
        answer = executive.call(way_to(3.0))
        assert answer.result.code == PlanningResult.SUCCESS, answer.result.text
        self.first: ContactSequence = answer.sequence
        executive.listen()
        self.wait_for(PlannerStatus.VALID)
        self.execute(EXECUTED)
        self.wait_until_in(EXECUTED)

    @property
    def status(self) -> PlannerStatus:
        """The newest status."""
        return self.executive.statuses[-1]

    @property
    def sequence(self) -> ContactSequence:
        """The newest published sequence."""
        return self.executive.sequences[-1]

    def change(self, *added: Surface, removed: tuple[str, ...] = ()) -> None:
        """Set and remove tiles."""
        message = SurfaceArray(is_diff=True, surfaces=list(added), removed_ids=list(removed))
        self.executive.publish(message)

    def wait_for(self, state: int, revision: int = 0) -> None:
        """Wait for a status of the sequence, and for the revision of that status."""
        told, published = self.executive.statuses, self.executive.sequences
        wanted = (self.first.sequence_id, state, revision)
        self.executive.spin_until(
            lambda: told and (told[-1].sequence_id, told[-1].state, told[-1].revision) == wanted,
            f"status {state} of revision {revision}",
        )
        self.executive.spin_until(
            lambda: published and published[-1].revision == revision, "the revision"
        )

    def require_clean(self, *removed: str) -> None:
        """Require that the check finds no violations on all tiles but some."""
        entries = tuple(
            SurfaceEntry(
                id=tile.id, vertices=tuple((p.x, p.y, p.z) for p in tile.vertices), friction=0.5
            )
            for tile in TILES
            if tile.id not in removed
        )
        guide = self.executive.guides[-1]
        plan = plan_of_messages(self.sequence, guide, EnvironmentEntry(surfaces=entries))
        report = check_plan(plan)
        assert report.valid, [str(violation) for violation in report.violations[:5]]

    def execute(self, state: int, revision: int = 0) -> None:
        """Report the state that the robot is in."""
        there = self._execution.get_subscription_count
        self.executive.spin_until(lambda: there() > 0, "a subscriber")
        identity = self.first.sequence_id
        message = ExecutionState(sequence_id=identity, revision=revision, state=state)
        self._execution.publish(message)

    def wait_until_in(self, state: int) -> None:
        """Wait until the status has a state as the executed one."""
        self.executive.spin_until(lambda: self.status.executed_state == state, "notice of it")


def stands_on(state: ContactState, names: set[str]) -> bool:
    """Whether a contact of a state is on one of the surfaces."""
    return any(contact.surface_id in names for contact in state.contacts)


def ahead_of(walk: Walk) -> set[str]:
    """Tiles on which only states stand that are not executed yet."""
    over = {c.surface_id for s in walk.first.states[: EXECUTED + 1] for c in s.contacts}
    return {tile.id for tile in TILES} - over


@pytest.fixture
def walk(executive: Executive) -> Walk:
    """A sequence over all tiles."""
    return Walk(executive)


def test_lost_tile_is_told_and_stepped_over(walk: Walk) -> None:
    lost = [i for i, state in enumerate(walk.first.states) if stands_on(state, {FAR})]
    assert lost
    assert lost[0] > EXECUTED
    walk.change(removed=(FAR,))
    walk.wait_for(PlannerStatus.VALID, 1)
    told = [s for s in walk.executive.statuses if s.state == PlannerStatus.INVALIDATED]
    assert [state.index for state in told[0].invalid_states] == lost
    assert {state.reason for state in told[0].invalid_states} == {InvalidState.SURFACE_LOST}
    assert {state.surface_id for state in told[0].invalid_states} == {FAR}
    assert (told[0].revision, told[0].valid_states) == (0, lost[0])
    assert any(s.state == PlannerStatus.REPLANNING for s in walk.executive.statuses)
    changed = walk.sequence.first_changed_state
    assert EXECUTED < changed <= lost[0]
    assert walk.sequence.states[:changed] == walk.first.states[:changed]
    assert walk.sequence.complete
    assert not any(stands_on(state, {FAR}) for state in walk.sequence.states)
    walk.require_clean(FAR)


def test_nothing_is_planned_where_nothing_ahead_is_touched(walk: Walk) -> None:
    version = walk.status.environment_version
    walk.change(tile("beside", 1.0, y=5.0))
    walk.executive.spin_until(lambda: "beside" in walk.executive.known(), "the new tile")
    walk.change(tile("beside", 1.0, y=6.0))
    walk.change(removed=("beside",))
    walk.executive.spin_until(lambda: "beside" not in walk.executive.known(), "its end")
    walk.change(removed=(FAR,))  # its status follows the validation of all changes before it
    walk.wait_for(PlannerStatus.VALID, 1)
    assert walk.status.environment_version >= version + 4
    assert [sequence.revision for sequence in walk.executive.sequences] == [0, 1]


def test_way_that_closes_and_opens_again(walk: Walk) -> None:
    ahead = ahead_of(walk)
    holding = next(i for i, state in enumerate(walk.first.states) if stands_on(state, ahead))
    walk.change(removed=tuple(ahead))
    walk.wait_for(PlannerStatus.FAILED, 1)
    assert walk.status.result.code != PlanningResult.SUCCESS
    assert walk.status.result.text
    assert walk.status.valid_states == holding
    assert not walk.sequence.complete
    assert walk.sequence.first_changed_state == holding
    assert walk.sequence.states == walk.first.states[:holding]
    walk.change(*(tile for tile in TILES if tile.id in ahead))
    walk.wait_for(PlannerStatus.VALID, 2)
    assert walk.sequence.complete
    assert walk.status.result.code == PlanningResult.SUCCESS
    assert walk.sequence.first_changed_state > EXECUTED
    assert walk.sequence.states[: EXECUTED + 1] == walk.first.states[: EXECUTED + 1]
    walk.require_clean()


def test_ground_that_goes_from_under_the_robot(walk: Walk) -> None:
    walk.executive.publish(SurfaceArray())
    walk.wait_for(PlannerStatus.FAILED)
    assert walk.status.result.code == PlanningResult.START_UNREACHABLE
    assert f"state {EXECUTED}" in walk.status.result.text
    assert walk.status.valid_states == EXECUTED
    walk.executive.publish(SurfaceArray(surfaces=TILES))
    walk.wait_for(PlannerStatus.VALID)
    assert walk.sequence == walk.first


def test_burst_ends_on_the_newest_surfaces(walk: Walk) -> None:
    tiles = {t.id: t for t in TILES}
    version = walk.status.environment_version
    for _ in range(10):
        walk.change(removed=(FAR,))
        walk.change(tiles[FAR])
    walk.change(removed=(FAR,))
    walk.executive.spin_until(
        lambda: (
            walk.status.state == PlannerStatus.VALID
            and walk.status.environment_version >= version + 21
        ),
        "a sequence for the newest",
    )
    walk.executive.spin_until(lambda: walk.sequence.revision == walk.status.revision, "it")
    assert not any(stands_on(state, {FAR}) for state in walk.sequence.states)
    walk.require_clean(FAR)


def test_replan_call(walk: Walk) -> None:
    states = walk.first.states
    at = len(states) // 2
    request = Replan.Request(sequence_id=walk.first.sequence_id, from_state=at, seed=5)
    answer = walk.executive.ask(Replan, "replan", request)
    assert answer.result.code == PlanningResult.SUCCESS, answer.result.text
    revision = answer.sequence
    assert (revision.sequence_id, revision.revision) == (walk.first.sequence_id, 1)
    assert revision.first_changed_state == at + 1
    assert revision.states[: at + 1] == states[: at + 1]
    walk.wait_for(PlannerStatus.VALID, 1)
    assert walk.sequence == revision
    walk.require_clean()


@pytest.mark.parametrize("index", [-2, 0, EXECUTED - 1, 100_000])
def test_replan_call_from_a_state_that_it_cannot_be_from(walk: Walk, index: int) -> None:
    result = walk.executive.ask(Replan, "replan", Replan.Request(from_state=index)).result
    assert (result.code, result.field) == (PlanningResult.INVALID_INPUT, "from_state")


def test_replan_call_of_another_sequence(walk: Walk) -> None:
    result = walk.executive.ask(Replan, "replan", Replan.Request(sequence_id="another")).result
    assert (result.code, result.value) == (PlanningResult.UNKNOWN_SEQUENCE, "another")


def test_replan_call_from_a_measured_state(walk: Walk) -> None:
    measured = walk.first.states[EXECUTED]
    measured.root.position.z += 0.002
    request = Replan.Request(measured_state=[measured])
    answer = walk.executive.ask(Replan, "replan", request)
    assert answer.result.code == PlanningResult.SUCCESS, answer.result.text
    assert answer.sequence.first_changed_state == 0
    assert answer.sequence.complete
    surfaces = [contact.surface_id for contact in answer.sequence.states[0].contacts]
    assert surfaces == [contact.surface_id for contact in measured.contacts]


def test_changes_are_looked_at_while_a_caller_waits_for_a_plan(shared: Site, walk: Walk) -> None:
    """Automatic replanning waits for the planning process meanwhile; validation does not."""
    worker = shared.processes[0].worker()
    os.kill(worker, signal.SIGSTOP)
    try:
        call = walk.executive.start_call(way_to(1.0))
        walk.executive.spin_until(lambda: walk.status.state == PlannerStatus.PLANNING, "planning")
        for _ in range(6):  # more than replanning.max_restarts
            walk.change(removed=(FAR,))
            walk.executive.spin_until(lambda: bool(walk.status.invalid_states), "its loss")
            walk.change(next(tile for tile in TILES if tile.id == FAR))
            walk.executive.spin_until(lambda: not walk.status.invalid_states, "its return")
        assert not call.done()
    finally:
        os.kill(worker, signal.SIGCONT)
    assert walk.executive.answer(call).result.code == PlanningResult.SUCCESS


def test_of_another_revision_counts_what_both_have(walk: Walk) -> None:
    walk.change(removed=(FAR,))
    walk.wait_for(PlannerStatus.VALID, 1)
    changed = walk.sequence.first_changed_state
    last = len(walk.sequence.states) - 1
    walk.execute(last, revision=2)  # there is no such revision
    walk.execute(last, revision=0)  # the robot moved on while the new revision was on its way
    walk.wait_until_in(changed - 1)
    walk.execute(changed, revision=1)
    walk.wait_until_in(changed)


def test_a_plan_that_fails_leaves_the_published_one_as_it_stands(walk: Walk) -> None:
    answer = walk.executive.call(way_to(50.0))
    assert answer.result.code != PlanningResult.SUCCESS
    walk.executive.spin_until(
        lambda: walk.status.result.code == answer.result.code, "the reason in the status"
    )
    assert (walk.status.state, walk.status.sequence_id) == (
        PlannerStatus.VALID,
        walk.first.sequence_id,
    )
    walk.change(removed=(FAR,))
    walk.wait_for(PlannerStatus.VALID, 1)
    assert walk.status.result.code == PlanningResult.SUCCESS


def test_two_changes_at_once_are_both_told(walk: Walk) -> None:
    """The second change comes during the validation of the first, or during replanning."""
    ahead = sorted(ahead_of(walk))
    walk.change(removed=(FAR,))
    walk.change(removed=tuple(name for name in ahead if name != FAR))
    walk.wait_for(PlannerStatus.FAILED, walk.status.revision + 1)
    assert not any(stands_on(state, set(ahead)) for state in walk.sequence.states)
    walk.change(*(tile for tile in TILES if tile.id in ahead))
    walk.wait_for(PlannerStatus.VALID, walk.status.revision + 1)
    walk.require_clean()


def test_robot_that_goes_on_to_what_does_not_hold(shared: Site, walk: Walk) -> None:
    """During replanning that fails: the sequence must not end behind the robot."""
    ahead = ahead_of(walk)
    lost = next(i for i, state in enumerate(walk.first.states) if stands_on(state, ahead))
    worker = shared.processes[0].worker()
    os.kill(worker, signal.SIGSTOP)
    try:
        walk.change(removed=tuple(ahead))
        walk.wait_for(PlannerStatus.REPLANNING)
        walk.execute(lost)
        walk.wait_until_in(lost)
    finally:
        os.kill(worker, signal.SIGCONT)
    walk.wait_for(PlannerStatus.FAILED)
    assert walk.status.result.code == PlanningResult.START_UNREACHABLE
    assert f"state {lost}" in walk.status.result.text
    assert walk.sequence == walk.first
    walk.change(*(tile for tile in TILES if tile.id in ahead))
    walk.wait_for(PlannerStatus.VALID)


def test_one_plate_behind_a_lost_tile_is_not_forgotten(walk: Walk) -> None:
    """A tile is lost as an obstacle appears; the obstacle still counts when the tile is back."""
    where = walk.first.states[-1].root.position
    plate = tile("plate", where.x)
    for vertex in plate.vertices:
        vertex.z = where.z
    disable = Parameter("replanning.automatic", value=False).to_parameter_msg()
    ask = SetParameters.Request(parameters=[disable])
    walk.executive.ask(SetParameters, "set_parameters", ask)
    try:
        last = walk.first.states[-1].contacts[0].surface_id
        walk.change(plate, removed=(last,))
        walk.wait_for(PlannerStatus.INVALIDATED)
        walk.change(next(tile for tile in TILES if tile.id == last))
        walk.executive.spin_until(
            lambda: InvalidState.COLLISION in {s.reason for s in walk.status.invalid_states},
            "the plate",
        )
        assert walk.status.invalid_states[-1].index == len(walk.first.states) - 1
    finally:
        enable = Parameter("replanning.automatic", value=True).to_parameter_msg()
        ask = SetParameters.Request(parameters=[enable])
        walk.executive.ask(SetParameters, "set_parameters", ask)
