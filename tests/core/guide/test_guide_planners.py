"""Guide planners behind the protocol of the guide stage."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from rbprm_core.budget import Budget
from rbprm_core.errors import Cancelled
from rbprm_core.failures import Cause, Failure
from rbprm_core.guide.guide_options import GuideOptions
from rbprm_core.guide.protocol import GuideProblem
from rbprm_core.guide.registry import GUIDE_PLANNERS
from rbprm_core.guide.roadmap import RoadmapStore
from rbprm_core.guide.root_space import RootBounds, RootSpace
from rbprm_core.robot.data import RobotData
from rbprm_core.scene import Scene, Surface, make_surface
from rbprm_core.stages import Stage

LEGS = ("lf_leg", "rf_leg", "lh_leg", "rh_leg")
GROUND = [[-4, -3, 0], [4, -3, 0], [4, 3, 0], [-4, 3, 0]]
START, GOAL = (np.array([x, 0, 0.6, 0, 0, 0, 1]) for x in (-2.0, 2.0))
KEPT = (START, GOAL)
BOUNDS = RootBounds(np.array([-3.0, -2, 0.3]), np.array([3.0, 2, 1]), np.array([0.5, 0.2, 0.2]))

Make = Callable[..., GuideProblem]


@pytest.fixture
def problem(hyq_data: RobotData, make_box: Callable[..., list[Surface]]) -> Make:
    """Makes a problem: HyQ on flat ground, with a wall that leaves room on one side."""
    wall = make_box("wall", np.array([-0.2, -3, 0.0]), np.array([0.2, 0.5, 2.0]))
    scene = Scene([make_surface("g", GROUND, 0.5), *wall])
    space = RootSpace(BOUNDS, np.zeros(0), np.zeros(0))
    gravity = np.array([0, 0, -9.81])
    return lambda **fields: GuideProblem(
        **{
            "data": hyq_data, "scene": scene, "start": START, "goal": GOAL, "space": space,
            "required_limbs": LEGS, "gravity": gravity, **fields,
        }
    )  # fmt: skip


@pytest.mark.parametrize("name", ["rrt", "prm"])
def test_a_guide_is_shortened_and_settled(problem: Make, hyq_data: RobotData, name: str) -> None:
    factory = GUIDE_PLANNERS.get(name, "stages.guide")
    whole = problem()
    problems = (
        problem(options=GuideOptions(shortcuts=0, settle=False)),
        problem(options=GuideOptions(settle=False)),
        whole,
    )
    raw, short, settled = (factory(p).find(Budget(), np.random.default_rng(1)) for p in problems)
    assert raw.nodes == short.nodes == settled.nodes
    assert raw.guide.length > short.guide.length
    middle = settled.guide.root(settled.guide.length / 2)
    assert middle[2] == pytest.approx(hyq_data.height, abs=0.01)
    assert whole.counters.seconds[Stage.SHORTCUT] > 0
    for guide in (raw.guide, short.guide, settled.guide):
        assert np.array_equal(guide.nodes[[0, -1]], [START, GOAL])
        assert np.array_equal(guide.root(0.0), START)
        assert np.array_equal(guide.roots(np.array([guide.length])), [GOAL])
        assert guide.posture(0.0) is None


def test_without_gravity_a_guide_is_not_settled(problem: Make) -> None:
    factory = GUIDE_PLANNERS.get("rrt", "stages.guide")
    results = [
        factory(problem(gravity=np.zeros(3), options=GuideOptions(settle=settle))).find(
            Budget(), np.random.default_rng(0)
        )
        for settle in (True, False)
    ]
    assert np.array_equal(results[0].guide.nodes, results[1].guide.nodes)


def test_a_guide_keeps_away_from_an_avoided_root(problem: Make) -> None:
    planner = GUIDE_PLANNERS.get("rrt", "stages.guide")(problem())
    beside = np.array([1.0, 1.0, 0.6, 0, 0, 0, 1])
    assert planner.failure(beside) is None
    first = planner.find(Budget(), np.random.default_rng(0)).guide
    stopped = first.root(0.5 * first.length)
    planner.avoid(stopped, KEPT)
    other = planner.find(Budget(), np.random.default_rng(0), direct=False).guide
    spacing = np.linspace(0, other.length, 200)
    assert np.linalg.norm(other.roots(spacing)[:, :3] - stopped[:3], axis=1).min() > 0.05
    planner.forget()


def test_the_failure_of_a_root(problem: Make) -> None:
    planner = GUIDE_PLANNERS.get("rrt", "stages.guide")(problem())
    inside, above = (np.array([0, 0, z, 0, 0, 0, 1.0]) for z in (0.6, 5.0))
    assert planner.trunk_failure(inside) == Failure.of(Cause.TRUNK_IN_OBSTACLE)
    failure = planner.failure(above)
    assert failure is not None
    assert (failure.cause, failure.limb) == (Cause.NO_SURFACE_IN_WORKSPACE, "lf_leg")
    assert planner.trunk_failure(above) is None


def test_prm_keeps_its_roadmap_in_the_store(problem: Make) -> None:
    roadmaps = RoadmapStore()
    factory = GUIDE_PLANNERS.get("prm", "stages.guide")
    for _ in range(2):
        factory(problem(roadmaps=roadmaps)).find(Budget(), np.random.default_rng(0))
        assert len(roadmaps) == 1
    options = GuideOptions(resolution=0.07)
    factory(problem(roadmaps=roadmaps, options=options))
    assert len(roadmaps) == 2


def test_building_a_planner_polls_the_budget(problem: Make) -> None:
    with pytest.raises(Cancelled):
        GUIDE_PLANNERS.get("rrt", "")(problem(budget=Budget(cancelled=lambda: True)))
