"""Guide planners and conditions chosen by a request, in complete plans."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rbprm_core.budget import Budget
from rbprm_core.check import check_plan
from rbprm_core.errors import NoGuideFound
from rbprm_core.guide.root import GuideOptions, RoadmapStore, RootBounds, RrtOptions
from rbprm_core.outcome import Outcome
from rbprm_core.placement import Placement
from rbprm_core.plan_conversion.states_to_plan import contact_plan
from rbprm_core.plan_record import EnvironmentEntry, SurfaceEntry
from rbprm_core.planner import plan
from rbprm_core.request import PlannerOptions, PlanRequest, StageNames
from rbprm_core.robot.data import RobotData
from rbprm_core.scene import Scene, Surface, make_surface

LEGS = ("lf_leg", "rf_leg", "lh_leg", "rh_leg")
GROUND = [[-2, -2, 0], [5, -2, 0], [5, 2, 0], [-2, 2, 0]]


def request(seed: int = 0, **options: object) -> PlanRequest:
    """Request for HyQ to walk 2.4 m over the ground, past obstacles."""
    return PlanRequest(
        start=Placement.parse((0, 0, 0.62)),
        goal=Placement.parse((2.4, 0, 0.62)),
        bounds=RootBounds(np.array([-1, -1.5, 0.4]), np.array([4, 1.5, 0.8]), np.full(3, 0.4)),
        required_limbs=LEGS,
        start_limbs=LEGS,
        robustness_threshold=5.0,
        seed=seed,
        options=PlannerOptions(guide=GuideOptions(**options)),
        stages=StageNames(guide="prm"),
    )


def post(y: float) -> list[Surface]:
    """A wall across the straight path that leaves room on one side."""
    low, high = (-2.0, 0.2) if y < 0 else (-0.2, 2.0)
    ring = [[1.2, low, 0], [1.2, high, 0], [1.2, high, 1.5], [1.2, low, 1.5]]
    return [make_surface("front", ring[::-1], 0.5), make_surface("back", ring, 0.5)]


def entry(scene: Scene) -> EnvironmentEntry:
    surfaces = [
        SurfaceEntry(id=s.id, vertices=tuple(map(tuple, s.polygon.boundary.tolist())))
        for s in scene.surfaces
    ]
    return EnvironmentEntry(name="walls", surfaces=tuple(surfaces))


def assert_valid(outcome: Outcome, data: RobotData, scene: Scene) -> None:
    report = check_plan(contact_plan(outcome, request(), data.robot, entry(scene)))
    assert report.valid, [str(violation) for violation in report.violations]


def test_plans_on_a_roadmap_fresh_and_kept(hyq_data: RobotData) -> None:
    scene = Scene([make_surface("ground", GROUND, 0.5), *post(-1)])
    fresh = [plan(request(1), hyq_data, scene, Budget(60.0)) for _ in range(2)]
    assert np.array_equal(fresh[0].guide.nodes, fresh[1].guide.nodes)
    assert_valid(fresh[0], hyq_data, scene)
    roadmaps = RoadmapStore()
    first = plan(request(1), hyq_data, scene, Budget(60.0), roadmaps)
    assert np.array_equal(first.guide.nodes, fresh[0].guide.nodes)  # the store was empty
    assert len(roadmaps) == 1
    second = plan(request(2), hyq_data, scene, Budget(60.0), roadmaps)
    assert_valid(second, hyq_data, scene)
    other = scene.edited(post(1))  # the passage moves to the other side
    third = plan(request(3), hyq_data, other, Budget(60.0), roadmaps)
    assert_valid(third, hyq_data, other)
    assert second.guide.nodes[:, 1].max() > 0.3
    assert third.guide.nodes[:, 1].min() < -0.3
    assert len(roadmaps) == 1


def test_the_equilibrium_condition_refuses_a_bridge_under_two_feet(
    hyq_data: RobotData,
) -> None:
    """A bridge under the left feet alone admits a guide for two legs, but no equilibrium."""
    ring = [[0.5, 0.3, 0], [4.5, 0.3, 0], [4.5, 0.5, 0], [0.5, 0.5, 0]]
    ends = [
        make_surface(n, [[a, -2, 0], [b, -2, 0], [b, 2, 0], [a, 2, 0]], 0.5)
        for n, a, b in (("a", -2, 1.0), ("b", 3.5, 6))
    ]
    scene = Scene([*ends, make_surface("bridge", ring, 0.5)])
    low, high = np.array([-1.0, -0.05, 0.4]), np.array([5.0, 0.05, 0.8])
    crossing = replace(
        request(),
        goal=Placement.parse((4.5, 0, 0.62)),
        bounds=RootBounds(low, high, np.full(3, 0.05)),
        required_limbs=(LEGS[0], LEGS[2]),
        stages=StageNames(guide="rrt"),
        options=PlannerOptions(
            guide=GuideOptions(equilibrium=True, rrt=RrtOptions(iterations=30)), guides=2
        ),
    )
    with pytest.raises(NoGuideFound):
        plan(crossing, hyq_data, scene, Budget(60.0))
