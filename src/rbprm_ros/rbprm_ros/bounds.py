"""Bounds of the root that a request leaves open: as wide as the task, no wider."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
import pinocchio as pin
from pydantic import Field

from rbprm_core.guide.space import RootBounds
from rbprm_core.placement import Placement
from rbprm_core.scene import Surface

Angle = Annotated[float, Field(ge=0, le=math.pi)]


@dataclass(frozen=True)
class BoundsRule:
    """How bounds are derived.

    Attributes:
        margin: of the box around start, goal and all surfaces, metres.
        yaw: least half range about z, radians; start and goal widen it.
        pitch: least half range about y, radians; start and goal widen it.
        roll: least half range about x, radians; start and goal widen it.
    """

    margin: Annotated[float, Field(ge=0)] = 1.0
    yaw: Angle = 0.4
    pitch: Angle = 0.3
    roll: Angle = 0.3


def derived_bounds(
    start: Placement, goal: Placement, surfaces: Sequence[Surface], rule: BoundsRule
) -> RootBounds:
    """Bounds that hold start and goal, over all surfaces."""
    rings = [surface.polygon.boundary for surface in surfaces]
    points = np.vstack([start.position, goal.position, *rings])
    angles = np.abs([_yaw_pitch_roll(start), _yaw_pitch_roll(goal)])
    return RootBounds(
        low=points.min(axis=0) - rule.margin,
        high=points.max(axis=0) + rule.margin,
        half_ranges=np.maximum(angles.max(axis=0), [rule.yaw, rule.pitch, rule.roll]),
    )


def _yaw_pitch_roll(placement: Placement) -> list[float]:
    rotation = pin.Quaternion(placement.orientation).matrix()
    return pin.rpy.matrixToRpy(rotation)[::-1].tolist()
