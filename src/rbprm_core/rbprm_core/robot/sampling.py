"""Random valid configurations of one limb: inside its limits and free of self-collision."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from rbprm_core.arrays import Array
from rbprm_core.errors import InvalidInput
from rbprm_core.robot.bodies import Bodies
from rbprm_core.robot.limb import Limb
from rbprm_core.robot.model import Robot
from rbprm_core.robot.projection import face
from rbprm_core.surface_kind import SurfaceKind

MIN_VALID = 100  # configurations; fewer valid ones mean a fault in the description
PITCHED = 0.5  # share of the samples for a root at any pitch in the limb's pitch range
MAX_TILT = 0.35  # tangent of the largest tilt of the surfaces that samples of a patch face
REPORT_EVERY = 50  # configurations, a few hundredths of a second: a report may stop the work


@dataclass(frozen=True, eq=False)
class LimbSamples:
    """Valid configurations of a limb and quantities derived from them.

    Attributes:
        joints: (m, n) joint positions, radians or metres.
        positions: (m, 3) origins of the contact frame in the base frame, metres.
        rotations: (m, 3, 3) rotations of the contact frame in the base frame.
        jacobians: (m, 3, n) Jacobians of the positions in the base frame (Tonneau et al. 2018,
            equation 10).
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
    """The valid ones of some configurations drawn uniformly inside the limb's limits.

    Configurations of a limb with a planar contact spot are turned first so that the spot faces a
    surface. Valid configurations are free of collisions of the limb with itself and with the root
    part (Tonneau et al. 2018, section 4.1 and appendix A.1).

    Args:
        robot: the robot; its other joints keep the reference posture.
        bodies: collision bodies of the robot.
        limb: a limb of the robot.
        draws: number of configurations drawn.
        rng: source of the configurations.
        report: function called with the share done, 0 to 1; may raise to stop.

    Raises:
        InvalidInput: fewer than `MIN_VALID` valid configurations, so the description must be wrong.
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
    return _derive(limb, drawn[valid], report)


def _derive(limb: Limb, kept: Array, report: Callable[[float], None]) -> LimbSamples:
    """Samples of a limb from their joints (m, n)."""
    found, coms = [], np.empty((len(kept), 3))
    for i, joints in enumerate(kept):
        if i % REPORT_EVERY == 0:
            report(1.0)
        found.append(limb.kinematics.placement_and_jacobian(joints))
        coms[i] = limb.kinematics.com(joints)
    positions, rotations, jacobians = (np.array(part) for part in zip(*found, strict=True))
    return LimbSamples(kept, positions, rotations, jacobians[:, :3], coms)


def _face_surface(limb: Limb, joints: Array, rng: np.random.Generator) -> Array | None:
    """Joints (n,) near given ones at which the patch faces a random surface that the limb may use.

    It is needed since few random postures of a leg have a level sole.
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
