"""Where the centre of mass would be with a limb in a sample: as if the limb were there."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from rbprm_core.contacts.along_guide import ContactGenerator
from rbprm_core.robot import Robot
from rbprm_core.scene import Scene

Array = NDArray[np.float64]
GRAVITY = np.array([0.0, 0.0, -9.81])


def anywhere(robot: Robot, rng: np.random.Generator) -> Array:
    """A configuration (nq,) somewhere in the world, with the joints that are planned anywhere."""
    q = robot.reference.copy()
    joints = [*robot.root_joints, *(int(j) for limb in robot.limbs for j in limb.joints)]
    index = [robot.model.joints[joint].idx_q for joint in joints]
    q[index] = rng.uniform(robot.low[index], robot.high[index])
    q[:3] = rng.uniform(-3, 3, 3)
    q[3:7] = pin.Quaternion(pin.exp3(rng.uniform(-2, 2, 3))).coeffs()
    return q


@pytest.fixture(scope="module", params=["hyq_data", "toy_data", "crawler_data"])
def generator(request: pytest.FixtureRequest, flat_scene: Scene) -> ContactGenerator:
    return ContactGenerator(request.getfixturevalue(request.param), flat_scene, GRAVITY, 0.0)


@settings(max_examples=50)
@given(seed=st.integers(0, 2**32 - 1))
def test_it_is_that_of_the_robot_with_the_limb_as_in_the_sample(
    generator: ContactGenerator, seed: int
) -> None:
    robot, databases = generator.robot, generator._databases
    rng = np.random.default_rng(seed)
    q = anywhere(robot, rng)
    scratch = robot.model.createData()
    pin.forwardKinematics(robot.model, scratch, q)
    for k, limb in enumerate(robot.limbs):
        balance = generator._balance(q, k, scratch.oMi[limb.base].copy())
        samples = rng.integers(len(databases[k].joints), size=6)
        for sample, com in zip(samples, balance.com(samples), strict=True):
            moved = q.copy()
            moved[limb.q_index] = databases[k].joints[sample]
            assert com == pytest.approx(generator.body.com(moved), abs=1e-6)
        assert 0 < balance.share < 0.5
