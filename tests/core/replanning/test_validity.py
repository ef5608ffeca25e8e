"""Which states a change of the scene takes away, and that no other is."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from rbprm_core.body.collision import CollisionModel
from rbprm_core.body.state import State
from rbprm_core.errors import InvalidInput
from rbprm_core.outcome import Outcome
from rbprm_core.replanning.validity import Reason, ValidityMonitor
from rbprm_core.request import PlanRequest
from rbprm_core.robot.data import RobotData
from rbprm_core.scene import Scene, Surface, make_surface
from rbprm_core.statics import Equilibrium, cone_generators, robustness

Array = NDArray[np.float64]
Planned = tuple[RobotData, Scene, PlanRequest, Outcome]


def watch(planned: Planned, free: Scene | None = None) -> ValidityMonitor:
    data, _, request, outcome = planned
    least = request.robustness_threshold
    return ValidityMonitor(data, outcome.states, least, request.gravity, free=free)


def plate(name: str, x: float, y: float, z: float, half: float) -> Surface:
    ring = [(x - half, y - half), (x + half, y - half), (x + half, y + half), (x - half, y + half)]
    return make_surface(name, [(*corner, z) for corner in ring], 0.5)


@pytest.mark.parametrize("name", ["climb", "trot"])
def test_a_plan_holds_where_it_was_made(name: str, request: pytest.FixtureRequest) -> None:
    planned = request.getfixturevalue(name)
    scene = planned[1]
    assert watch(planned).invalid(scene) == ()
    assert watch(planned, scene).invalid(scene) == ()


def test_states_on_a_lost_surface_are_named(climb: Planned) -> None:
    _, scene, _, outcome = climb
    on_step = [
        i for i, s in enumerate(outcome.states) if any(c.surface == "step" for c in s.contacts)
    ]
    found = watch(climb, scene).invalid(scene.edited(removed=["step"]))
    assert [state.index for state in found] == on_step
    assert {state.reason for state in found} == {Reason.SURFACE_LOST}
    assert {state.surface for state in found} == {"step"}
    assert {state.limb for state in found} <= {"left_leg", "right_leg"}
    later = watch(climb, scene).invalid(scene.edited(removed=["step"]), on_step[2])
    assert [state.index for state in later] == on_step[2:]


def test_new_ids_and_outlines_take_nothing_away(climb: Planned) -> None:
    _, scene, _, _ = climb
    step = scene.surfaces[scene.index["step"]]
    larger = make_surface("renamed", step.polygon.boundary * [1, 1.2, 1], step.friction)
    assert watch(climb, scene).invalid(scene.edited([larger], ["step"])) == ()


def test_a_hole_under_a_foot_takes_its_states(climb: Planned) -> None:
    _, scene, _, outcome = climb
    state = outcome.states[-1]
    x, y, _ = state.contacts[-1].position
    ground = scene.surfaces[scene.index["step"]]
    hole = [[x - 0.02, y - 0.02, 0.2], [x + 0.02, y - 0.02, 0.2], [x, y + 0.02, 0.2]]
    holed = make_surface("step", ground.polygon.boundary, ground.friction, (hole,))
    found = watch(climb, scene).invalid(scene.edited([holed]))
    touching = [i for i, s in enumerate(outcome.states) if state.contacts[-1] in s.contacts]
    assert [s.index for s in found if s.limb] == touching


def test_ice_takes_what_it_does_not_hold(climb: Planned) -> None:
    """On a slope of 12 degrees: gravity leans, which friction of 0.5 bears and 0.05 does not."""
    data, scene, _, outcome = climb
    gravity = np.array([0.0, 2.0, -9.6])
    seen = ValidityMonitor(data, outcome.states, -1e6, gravity, free=scene)
    slippery = Scene([replace(surface, friction=0.05) for surface in scene.surfaces])

    def values(friction: float) -> list[float]:
        return [b0(data, state, friction, gravity) for state in outcome.states]

    assert seen.invalid(slippery) == ()
    seen = ValidityMonitor(data, outcome.states, 0.0, gravity, free=scene)
    for friction, today in ((0.5, scene), (0.05, slippery)):
        found = seen.invalid(today)
        assert {state.reason for state in found} == {Reason.NOT_IN_EQUILIBRIUM}
        expected = [i for i, value in enumerate(values(friction)) if value < -1e-3]
        assert [state.index for state in found] == expected
    assert sum(value < 0 for value in values(0.5)) < sum(value < 0 for value in values(0.05))


def b0(data: RobotData, state: State, friction: float, gravity: Array) -> float:
    points = np.concatenate([contact.points for contact in state.contacts])
    rays = np.concatenate(
        [[cone_generators(c.rotation, friction)] * len(c.points) for c in state.contacts]
    )
    return robustness(Equilibrium.of(points, rays, state.com, data.robot.mass, gravity))


def test_a_higher_threshold_is_held_by_few(climb: Planned) -> None:
    data, scene, request, outcome = climb
    least = sorted(state.robustness for state in outcome.states)[3]
    found = ValidityMonitor(data, outcome.states, least, request.gravity).invalid(scene)
    assert [s.index for s in found] == [
        i for i, s in enumerate(outcome.states) if s.robustness < least - 1e-3
    ]
    assert {state.reason for state in found} == {Reason.NOT_IN_EQUILIBRIUM}


@pytest.mark.parametrize("seed", range(4))
def test_collisions_are_those_of_the_planner(climb: Planned, seed: int) -> None:
    """Plates anywhere along the way: culled and incremental, the answer is the full one."""
    data, scene, _, outcome = climb
    rng = np.random.default_rng(seed)
    places = rng.uniform([-0.5, -0.4, 0.15], [0.7, 0.4, 1.6], (3, 3))
    plates = [plate(f"plate_{k}", *place, 0.05) for k, place in enumerate(places)]
    crowded = scene.edited(plates)
    model = CollisionModel(data, crowded)
    expected = []
    for i, state in enumerate(outcome.states):
        contacts = [state.contact_of(k) for k in range(len(data.robot.limbs))]
        limbs_free = all(
            model.limb_free(state.q, k, None if c is None else c.normal)
            for k, c in enumerate(contacts)
        )
        if not (limbs_free and model.root_free(state.q)):
            expected.append(i)
    assert expected  # or the seed says nothing
    for before in (scene, None):
        found = watch(climb, before).invalid(crowded)
        assert [state.index for state in found] == expected
        assert {state.reason for state in found} == {Reason.COLLISION}
        assert all("body" in state.text for state in found)


def test_a_collision_behind_a_lost_surface_is_not_forgotten(climb: Planned) -> None:
    """A surface goes as an obstacle comes; when it is back, the obstacle still is there."""
    _, scene, _, outcome = climb
    seen = watch(climb, scene)
    block = plate("block", *outcome.states[-1].q[:3], 0.1)
    crowded = scene.edited([block])
    lost = seen.invalid(crowded.edited(removed=["step"]))
    assert lost[-1].reason == Reason.SURFACE_LOST  # the first of its reasons
    found = seen.invalid(crowded)
    assert found == watch(climb).invalid(crowded)
    assert found[-1].reason == Reason.COLLISION
    assert seen.invalid(scene) == ()


def test_what_is_free_from_a_later_state_says_nothing_of_earlier_ones(climb: Planned) -> None:
    _, scene, _, outcome = climb
    seen = watch(climb, scene)
    x, y, z = outcome.states[0].q[:3]
    crowded = scene.edited([plate("block", x, y, z, 0.05)])
    last = len(outcome.states) - 1
    assert seen.invalid(crowded, last) == ()
    assert seen.invalid(crowded)[0].index == 0


def test_obstacles_that_are_new_are_hit(climb: Planned) -> None:
    _, scene, _, outcome = climb
    x, y, z = outcome.states[-1].q[:3]
    triangle = np.array([[[x - 0.1, y, z], [x + 0.1, y - 0.1, z], [x + 0.1, y + 0.1, z]]])
    walled = Scene(scene.surfaces, triangle)
    found = watch(climb, scene).invalid(walled)
    assert found[-1].index == len(outcome.states) - 1
    assert (found[-1].reason, found[-1].limb) == (Reason.COLLISION, "")
    assert watch(climb, walled).invalid(walled) == ()


def test_one_change_among_many_surfaces_is_seen_at_once(climb: Planned) -> None:
    """The bar of the issue, with room for a slow machine: 50 ms from message to status."""
    data, scene, request, outcome = climb
    far = [plate(f"far_{k}", 50 + k % 20, k // 20, 0.0, 0.3) for k in range(200)]
    crowded = scene.edited(far)
    states = [outcome.states[i % len(outcome.states)] for i in range(60)]
    least = request.robustness_threshold
    seen = ValidityMonitor(data, states, least, request.gravity, free=crowded)
    changed = crowded.edited(removed=["step"])
    spent = []
    for _ in range(5):
        start = time.perf_counter()
        assert seen.invalid(changed)
        spent.append(time.perf_counter() - start)
    assert min(spent) < 0.05


def test_another_robots_states_are_refused(climb: Planned, trot: Planned) -> None:
    with pytest.raises(InvalidInput) as caught:
        ValidityMonitor(climb[0], trot[3].states, 0.0, climb[2].gravity)
    assert caught.value.field == "states.0.q"
