"""Random roots without gravity: on any side of a surface, for any limb."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from rbprm_core.arrays import Array
from rbprm_core.guide.root import Reachability, RootBounds, RootSampler, RootSpace
from rbprm_core.guide.root.sampler import effector_places
from rbprm_core.robot.data import RobotData
from rbprm_core.scenario import load_scenario
from rbprm_core.scene import Scene

NONE = np.zeros(0)


@pytest.fixture(scope="module")
def pen_scene() -> Scene:
    return load_scenario("pen").scene()


def sampler(data: RobotData, scene: Scene, effectors: Array | None) -> RootSampler:
    """Sampler of roots around the pen, in any orientation."""
    bounds = RootBounds(np.full(3, -0.4), np.full(3, 0.4), np.array([np.pi, np.pi / 2, np.pi]))
    limbs = tuple(limb.name for limb in data.robot.limbs)
    space = RootSpace(bounds, NONE, NONE)
    return RootSampler(space, scene, Reachability(data, scene, limbs), data.height, NONE, effectors)


def test_roots_lie_on_all_sides_of_the_pen(allegro_data: RobotData, pen_scene: Scene) -> None:
    rng = np.random.default_rng(0)
    draw = sampler(allegro_data, pen_scene, effector_places(allegro_data)).draw
    found = [root for root in (draw(rng) for _ in range(60)) if root is not None]
    assert len(found) > 50
    x, _, z = np.array(found)[:, :3].T
    quadrants = {(bool(a), bool(b)) for a, b in zip(x > 0, z > 0, strict=True)}
    assert len(quadrants) == 4


def test_some_effector_of_a_candidate_is_on_a_surface(
    allegro_data: RobotData, pen_scene: Scene
) -> None:
    rng = np.random.default_rng(1)
    places = effector_places(allegro_data)
    candidates = sampler(allegro_data, pen_scene, places).candidates
    corners = np.concatenate([s.polygon.boundary for s in pen_scene.surfaces])
    low, high = corners.min(axis=0) - 1e-9, corners.max(axis=0) + 1e-9
    for root in candidates(rng, 20):
        points = places @ pin.Quaternion(root[3:7]).matrix().T + root[:3]
        points = points[((points >= low) & (points <= high)).all(axis=1)]
        offsets = [np.abs((points - s.polygon.boundary[0]) @ s.normal) for s in pen_scene.surfaces]
        assert np.min(offsets) < 1e-9


def test_effector_places_agree_with_forward_kinematics(allegro_data: RobotData) -> None:
    robot, places = allegro_data.robot, effector_places(allegro_data)
    scratch = robot.model.createData()
    first = 0
    for limb, database in zip(robot.limbs, allegro_data.databases, strict=True):
        for i in (0, 7, len(database.joints) - 1):
            q = robot.reference.copy()
            q[limb.q_index] = database.joints[i]
            pin.framesForwardKinematics(robot.model, scratch, q)
            centre = scratch.oMf[limb.frame].act(limb.contact.translation)
            assert places[first + i] == pytest.approx(centre, abs=1e-5)
        first += len(database.joints)
    assert first == len(places)
