"""Simulated executions during which the environment is edited."""

from __future__ import annotations

from dataclasses import replace

import pytest

from rbprm_core.bench.replanning_benchmark import AppliedEdit, replanning_benchmark
from rbprm_core.check import check_plan
from rbprm_core.cli.replan import summary
from rbprm_core.errors import InvalidInput
from rbprm_core.robot.data import RobotData
from rbprm_core.scenario import EditText, Scenario, load_scenario


@pytest.fixture(scope="module")
def execution(talos_data: RobotData) -> list[AppliedEdit]:
    """The edits of the scenario `replanning`, applied."""
    return list(replanning_benchmark(load_scenario("replanning"), talos_data, 0, 3, 30.0))


def with_edits(scenario: Scenario, *edits: EditText) -> Scenario:
    return scenario.model_copy(update={"edits": edits})


def test_every_edit_of_the_scenario_gives_a_valid_revision(execution: list[AppliedEdit]) -> None:
    assert [edit.name for edit in execution] == [e.name for e in load_scenario("replanning").edits]
    for edit in execution:
        assert edit.valid, (edit.failure, edit.violations)
        assert edit.invalid
        assert edit.executed <= edit.from_state < edit.invalid[0].index
    assert execution[0].executed < execution[1].executed < execution[2].executed
    assert summary(execution).row_count == 6


def test_the_rest_is_checked_in_the_edited_environment(execution: list[AppliedEdit]) -> None:
    left = execution[-1].plan
    assert left.states[0].root.position == left.request.start.position
    assert "added_stair" in {surface.id for surface in left.environment.surfaces}
    # The check detects a plan that ignores an edit.
    surfaces = tuple(s for s in left.environment.surfaces if s.id != "last_stair_3")
    environment = left.environment.model_copy(update={"surfaces": surfaces})
    assert check_plan(left.model_copy(update={"environment": environment})).violations


def test_a_plan_without_invalid_states_is_kept(talos_data: RobotData) -> None:
    """An execution without a solution ends with the reason; the next has the next seed."""
    scenario = load_scenario("step20")
    behind = EditText(name="far side", at=0.6, removed=("riser",))
    gone = EditText(name="no goal", at=0.6, removed=("step",))
    applied: list[AppliedEdit] = list(
        replanning_benchmark(with_edits(scenario, behind, gone), talos_data, 0, 3, 30.0)
    )
    assert [(edit.seed, edit.name) for edit in applied] == [
        (0, "far side"), (0, "no goal"), (1, "far side"),
    ]  # fmt: skip
    kept, failed, _ = applied
    assert (kept.invalid, kept.from_state, kept.replanning) == ((), -1, 0.0)
    assert kept.valid
    assert failed.failure
    assert not failed.valid


def test_a_scenario_without_edits_is_refused(talos_data: RobotData) -> None:
    with pytest.raises(InvalidInput) as caught:
        next(replanning_benchmark(load_scenario("step20"), talos_data, 0, 1, 30.0))
    assert caught.value.field == "scenario"


def test_seconds_are_those_until_the_revision(execution: list[AppliedEdit]) -> None:
    assert replace(execution[0], validity=0.25, replanning=0.5).seconds == 0.75
