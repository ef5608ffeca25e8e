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
from rbprm_core.robot.projection import face
from rbprm_core.surface_kind import SurfaceKind

Array = NDArray[np.float64]

MIN_VALID = 100
PITCHED = 0.5  # share of the samples made for a root anywhere in the limb's pitch range
MAX_TILT = 0.35  # tangent of the tilt of the surfaces that samples of a patch face
REPORT_EVERY = 50  # configurations; a few hundredths of a second, for reports may stop the work


@dataclass(frozen=True, eq=False)
class LimbSamples:
    """Valid limb configurations and what the heuristics need of them.

    Attributes:
        joints: (m, n) joint positions.
        positions: (m, 3) effector centres in the base frame, metres.
        rotations: (m, 3, 3) of the contact frame in the base frame.
        jacobians: (m, 3, n) of the centres in the base frame (equation 10).
        coms: (m, 3) centres of mass of the limb in the base frame, metres.
    """

    joints: Array
    positions: Array
    rotations: Array
    jacobians: Array
    coms: Array


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
    pairs = bodies.limb_pairs(robot.limbs.index(limb))
    geometry = bodies.model(pairs)
    data, scratch = robot.model.createData(), geometry.createData()
    q = robot.reference.copy()
    drawn = rng.uniform(limb.low, limb.high, (draws, len(limb.joints)))
    valid = np.zeros(draws, dtype=bool)
    for i, joints in enumerate(drawn):
        if i % REPORT_EVERY == 0:
            report(i / draws)
        fitted = _face_surface(limb, joints, rng) if limb.planar else joints
        if fitted is None:
            continue
        drawn[i] = q[limb.q_index] = fitted
        valid[i] = not pin.computeCollisions(robot.model, data, geometry, scratch, q, True)
    if valid.sum() < MIN_VALID:
        faced = "face a surface and " if limb.planar else ""
        reason = (
            f"only {valid.sum()} of {draws} random configurations {faced}are free of "
            "self-collision: check the SRDF's disabled pairs and joint_ranges"
        )
        raise InvalidInput(f"limbs.{limb.name}", limb.effector, reason)
    kept = drawn[valid]
    found, coms = [], np.empty((len(kept), 3))
    for i, joints in enumerate(kept):
        if i % REPORT_EVERY == 0:
            report(1.0)
        found.append(limb.kinematics.placement_and_jacobian(joints))
        coms[i] = limb.kinematics.com(joints)
    positions, rotations, jacobians = (np.array(part) for part in zip(*found, strict=True))
    return LimbSamples(kept, positions, rotations, jacobians[:, :3], coms)


def _face_surface(limb: Limb, joints: Array, rng: np.random.Generator) -> Array | None:
    """Joints (n,) near the given ones whose patch faces a surface of a kind the limb may use.

    Few random postures of a leg have a level sole.
    """
    kind = limb.surfaces[rng.integers(len(limb.surfaces))]
    if kind is SurfaceKind.SUPPORT:
        tilt = rng.uniform(-MAX_TILT, MAX_TILT, 2)
        normal = np.array([tilt[0], tilt[1], 1.0])
    else:
        angle = rng.uniform(-np.pi, np.pi)
        normal = np.array([np.cos(angle), np.sin(angle), rng.uniform(-MAX_TILT, MAX_TILT)])
    normal /= np.linalg.norm(normal)
    if rng.random() < PITCHED:
        normal = pin.rpy.rpyToMatrix(0.0, -rng.uniform(*limb.root_pitch), 0.0) @ normal
    return face(limb, joints, normal)
