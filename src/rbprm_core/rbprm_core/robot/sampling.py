"""Valid configurations of one limb: inside its limits, clear of itself and of the root part."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from rbprm_core.errors import InvalidInput
from rbprm_core.robot.bodies import Bodies
from rbprm_core.robot.limb import Limb
from rbprm_core.robot.model import Robot

Array = NDArray[np.float64]

LEAST_VALID = 100
REPORT_EVERY = 1000


@dataclass(frozen=True, eq=False)
class LimbSamples:
    """Valid limb configurations and what the heuristics need of them.

    Attributes:
        joints: (m, n) joint positions.
        positions: (m, 3) effector centres in the base frame, metres.
        jacobians: (m, 3, n) of the centres in the base frame (equation 10).
    """

    joints: Array
    positions: Array
    jacobians: Array


def sample_limb(
    robot: Robot,
    bodies: Bodies,
    limb: Limb,
    draws: int,
    rng: np.random.Generator,
    report: Callable[[float], None],
) -> LimbSamples:
    """Draw limb configurations uniformly inside the limits and keep the valid ones.

    Args:
        draws: configurations drawn. report: told the share done, 0 to 1.

    Raises:
        InvalidInput: hardly any valid one; the description cannot be right.
    """
    pairs = bodies.limb_pairs(robot.limbs.index(limb), others=False)
    geometry = bodies.model(pairs)
    data, scratch = robot.model.createData(), geometry.createData()
    q = robot.reference.copy()
    drawn = rng.uniform(limb.low, limb.high, (draws, len(limb.joints)))
    valid = np.zeros(draws, dtype=bool)
    for i, joints in enumerate(drawn):
        q[limb.q_index] = joints
        valid[i] = not pin.computeCollisions(robot.model, data, geometry, scratch, q, True)
        if i % REPORT_EVERY == 0:
            report(i / draws)
    if valid.sum() < LEAST_VALID:
        reason = (
            f"only {valid.sum()} of {draws} random configurations are free of self-collision: "
            "check the SRDF's disabled pairs and joint_ranges"
        )
        raise InvalidInput(f"limbs.{limb.name}", limb.effector, reason)
    kept = drawn[valid]
    found = [limb.kinematics.position_and_jacobian(joints) for joints in kept]
    return LimbSamples(kept, np.array([p for p, _ in found]), np.array([j for _, j in found]))
