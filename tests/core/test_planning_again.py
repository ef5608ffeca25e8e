"""A plan is planned again from its file alone, with the same states."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from rbprm_core.budget import Budget
from rbprm_core.contacts.along_guide.options import GeneratorOptions
from rbprm_core.environment import load_scene
from rbprm_core.errors import InvalidInput
from rbprm_core.guide.guide_options import GuideOptions
from rbprm_core.guide.root_space import RootBounds
from rbprm_core.placement import Placement
from rbprm_core.plan_conversion.states_to_plan import contact_plan
from rbprm_core.plan_record import ContactPlan, EnvironmentEntry, SurfaceEntry
from rbprm_core.planner import plan
from rbprm_core.planning_input import input_from_plan, input_from_scenario, is_plan_file
from rbprm_core.request import PlannerOptions, PlanRequest
from rbprm_core.robot.data import RobotData, load_robot_data
from rbprm_core.scenario import Scenario, load_scenario
from rbprm_core.scene import Classification, Scene

VERSION_1 = Path(__file__).parent / "data" / "version_1.plan.json"


def made(
    request: PlanRequest, data: RobotData, scene: Scene, environment: EnvironmentEntry
) -> ContactPlan:
    outcome = plan(request, data, scene, Budget(request.time_limit or 60.0))
    return contact_plan(outcome, request, data.robot, environment)


def again(file: Path) -> ContactPlan:
    """The plan of a plan file's request, from nothing but the file."""
    given = input_from_plan(ContactPlan.read(file))
    data = load_robot_data(given.robot)
    return made(given.request, data, given.scene(), given.environment)


def require_same(first: ContactPlan, second: ContactPlan) -> None:
    assert second.states == first.states
    assert second.guide == first.guide
    assert second.request == first.request
    assert second.robot == first.robot
    assert second.environment.model_dump() == first.environment.model_dump()


@pytest.mark.parametrize("name", ["flat", "stairs15", "crawl", "pen", "standing"])
def test_scenarios(
    name: str, scenario_data: Callable[[Scenario], RobotData], tmp_path: Path
) -> None:
    """With trunks, heuristics, joints of the root, limbs and classifications of their own."""
    text = load_scenario(name)
    data = scenario_data(text)
    request = text.request_for(data.robot, seed=1)
    first = made(request, data, text.scene(), text.environment_entry())
    first.write(tmp_path / "a.json")
    require_same(first, again(tmp_path / "a.json"))


def test_the_rubble(rubble_plans: dict[int, ContactPlan], tmp_path: Path) -> None:
    rubble_plans[1].write(tmp_path / "a.json")
    require_same(rubble_plans[1], again(tmp_path / "a.json"))


def test_polygons_and_a_robot_of_ones_own(toy_data: RobotData, tmp_path: Path) -> None:
    """Two polygons, options that differ from the defaults, a joint planned with the root."""
    rings = (
        ((-1.0, -1.0, 0.0), (0.6, -1.0, 0.0), (0.6, 1.0, 0.0), (-1.0, 1.0, 0.0)),
        ((0.7, -1.0, 0.1), (2.0, -1.0, 0.1), (2.0, 1.0, 0.1), (0.7, 1.0, 0.1)),
    )
    entry = EnvironmentEntry(
        name="two polygons",
        surfaces=tuple(
            SurfaceEntry(id=f"s{i}", vertices=ring, friction=0.6) for i, ring in enumerate(rings)
        ),
    )
    scene = load_scene(entry, Classification())
    request = PlanRequest(
        start=Placement.parse([0.0, 0.0, 0.42]),
        goal=Placement.parse([1.2, 0.1, 0.52]),
        bounds=RootBounds(
            np.array([-1.0, -0.5, 0.2]), np.array([2.0, 0.5, 0.8]), np.array([0.5, 0.3, 0.3])
        ),
        required_limbs=("lf", "rf", "lh", "rh"),
        start_limbs=("rh", "lf", "rf", "lh"),
        robustness_threshold=2.0,
        seed=3,
        goal_limbs=("lf",),
        options=PlannerOptions(
            GuideOptions(shortcuts=3), generator=GeneratorOptions(candidates=20)
        ),
    )
    first = made(request, toy_data, scene, entry)
    assert len(first.states) > 5
    assert all(len(node.joints) == 1 for node in first.guide)
    first.write(tmp_path / "a.json")
    second = again(tmp_path / "a.json")
    require_same(first.model_copy(update={"request": second.request}), second)
    assert first.request.time_limit is None


def test_other_conditions_than_the_files(rubble_plans: dict[int, ContactPlan]) -> None:
    given = input_from_plan(rubble_plans[0], seed=5, robustness=3.0)
    assert (given.request.seed, given.request.robustness_threshold) == (5, 3.0)
    assert given.request.time_limit == 60.0
    for changes, field in (({"seed": -1}, "seed"), ({"robustness": -1.0}, "robustness_threshold")):
        with pytest.raises(InvalidInput) as caught:
            input_from_plan(rubble_plans[0], **changes)  # type: ignore[arg-type]
        assert caught.value.field == field


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"start_limbs": ("tail",)}, "request.start_limbs.0"),
        ({"bounds": None}, "request.bounds"),
        ({"options": None}, "request.options"),
        ({"options": {"gait": 1}}, "request.options.gait"),
        ({"options": {"sequence": {"step": 0.01}}}, "request.options.sequence.min_step"),
        ({"seed": -2}, "request.seed"),
    ],
)
def test_a_request_at_fault(
    rubble_plans: dict[int, ContactPlan], changes: dict[str, object], field: str
) -> None:
    found = rubble_plans[0]
    spoilt = found.model_copy(update={"request": found.request.model_copy(update=changes)})
    with pytest.raises(InvalidInput) as caught:
        input_from_plan(spoilt)
    assert caught.value.field == field


def test_a_plan_of_version_1_is_refused() -> None:
    with pytest.raises(InvalidInput, match="plan the scenario again") as caught:
        input_from_plan(ContactPlan.read(VERSION_1))
    assert caught.value.field == "robot.description"


def test_what_is_a_plan_file() -> None:
    assert is_plan_file("some/where.plan.json")
    assert not is_plan_file("rubble")
    assert not is_plan_file("mine.toml")
    assert input_from_scenario("flat", seed=4).request.seed == 4
