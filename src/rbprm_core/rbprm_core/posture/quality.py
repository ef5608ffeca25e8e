"""Figures on a posture: torques, joint limits, clearance, and the accuracy of its contacts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rbprm_core.body.contact import Contact
from rbprm_core.body.state import State
from rbprm_core.body.torques import TorqueBalance
from rbprm_core.posture.body_pairs import ENVIRONMENT
from rbprm_core.posture.constraints.contact_pose import ContactPose
from rbprm_core.posture.model import REACH, PostureModel


@dataclass(frozen=True, eq=False)
class PostureQuality:
    """Figures on a posture.

    Attributes:
        robustness: raw b0 on the supporting contacts, newtons.
        balance: forces and torques on the supporting contacts at the smallest torque ratio.
        joint: name of the joint nearest to a limit.
        joint_margin: its distance from the limit, radians or metres.
        clearance: smallest distance between bodies and from the environment, metres, limbs in
            contact left out; `REACH` where all are farther apart.
        bodies: names of the two bodies at this distance, the second one "" for the environment;
            both "" where all are farther apart.
        contact_error: largest distance of a limb from its contact, metres; an error of a radian
            counts as a metre.
    """

    robustness: float
    balance: TorqueBalance
    joint: str
    joint_margin: float
    clearance: float
    bodies: tuple[str, str]
    contact_error: float


def posture_quality(
    model: PostureModel, state: State, supporting: Sequence[Contact]
) -> PostureQuality:
    """The figures on a posture.

    Args:
        model: the robot in its scene.
        state: the posture.
        supporting: the contacts that carry the robot.
    """
    robot = model.robot
    kinematics = model.kinematics(state.q)
    joints = state.q[7:]
    margins = np.minimum(joints - robot.low[7:], robot.high[7:] - joints)
    tightest = int(np.argmin(margins))
    errors = [ContactPose(robot, c).rows(kinematics).violation for c in state.contacts]
    clearance, bodies = _clearance(model, state)
    return PostureQuality(
        robustness=model.stability.b0(supporting, state.com),
        balance=model.torques.balance(state.q, supporting),
        joint=robot.joint_names[tightest],
        joint_margin=float(margins[tightest]),
        clearance=clearance,
        bodies=bodies,
        contact_error=max(errors, default=0.0),
    )


def _clearance(model: PostureModel, state: State) -> tuple[float, tuple[str, str]]:
    """Smallest distance, and the names of the bodies."""
    pairs = model.pairs
    near = pairs.near(model.kinematics(state.q).data, {c.limb: c.normal for c in state.contacts})
    ends = [model.robot.limbs[contact.limb].last_joint for contact in state.contacts]
    touching = (near.second == ENVIRONMENT) & np.isin(pairs.joints[near.first], ends)
    gaps = np.where(touching, np.inf, near.gaps)
    if not len(gaps) or gaps.min() > REACH:
        return REACH, ("", "")
    first = int(np.argmin(gaps))
    second = int(near.second[first])
    other = "" if second == ENVIRONMENT else pairs.names[second]
    return float(gaps[first]), (pairs.names[near.first[first]], other)
