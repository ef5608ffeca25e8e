"""Walks during which the environment is edited."""

from __future__ import annotations

from dataclasses import replace

import pytest

from rbprm_core.bench.replanning_benchmark import PlayedEdit, replanning_benchmark
from rbprm_core.check import check_plan
from rbprm_core.cli.replan import summary
from rbprm_core.errors import InvalidInput
from rbprm_core.robot.data import RobotData
from rbprm_core.scenario import EditText, Scenario, load_scenario


@pytest.fixture(scope="module")
def walk(talos_data: RobotData) -> list[PlayedEdit]:
    """The edits of the paper's scene, played."""
    return list(replanning_benchmark(load_scenario("replanning"), talos_data, 0, 3, 30.0))


def with_edits(scenario: Scenario, *edits: EditText) -> Scenario:
    return scenario.model_copy(update={"edits": edits})


def test_the_papers_walk_is_revised_cleanly_at_every_edit(walk: list[PlayedEdit]) -> None:
    assert [edit.name for edit in walk] == [e.name for e in load_scenario("replanning").edits]
    for edit in walk:
        assert edit.clean, (edit.failure, edit.violations)
        assert edit.invalid
        assert edit.executed <= edit.from_state < edit.invalid[0].index
    assert walk[0].executed < walk[1].executed < walk[2].executed
    assert summary(walk).row_count == 6


def test_what_is_left_is_checked_as_it_is_now(walk: list[PlayedEdit]) -> None:
    left = walk[-1].plan
    assert left.states[0].root.position == left.request.start.position
    assert "added_stair" in {surface.id for surface in left.environment.surfaces}
    # The check would see a plan that ignores an edit.
    surfaces = tuple(s for s in left.environment.surfaces if s.id != "last_stair_3")
    environment = left.environment.model_copy(update={"surfaces": surfaces})
    assert check_plan(left.model_copy(update={"environment": environment})).violations


def test_a_plan_that_nothing_touches_stands(talos_data: RobotData) -> None:
    """And where no way is left, the walk ends with the reason; the next has the next seed."""
    scenario = load_scenario("step20")
    behind = EditText(name="far side", at=0.6, removed=("riser",))
    gone = EditText(name="no goal", at=0.6, removed=("step",))
    played: list[PlayedEdit] = list(
        replanning_benchmark(with_edits(scenario, behind, gone), talos_data, 0, 3, 30.0)
    )
    assert [(edit.seed, edit.name) for edit in played] == [
        (0, "far side"), (0, "no goal"), (1, "far side"),
    ]  # fmt: skip
    stood, failed, _ = played
    assert (stood.invalid, stood.from_state, stood.replanning) == ((), -1, 0.0)
    assert stood.clean
    assert failed.failure
    assert not failed.clean


def test_a_scenario_without_edits_is_refused(talos_data: RobotData) -> None:
    with pytest.raises(InvalidInput) as caught:
        next(replanning_benchmark(load_scenario("step20"), talos_data, 0, 1, 30.0))
    assert caught.value.field == "scenario"


def test_seconds_are_those_until_the_revision(walk: list[PlayedEdit]) -> None:
    assert replace(walk[0], validity=0.25, replanning=0.5).seconds == 0.75
