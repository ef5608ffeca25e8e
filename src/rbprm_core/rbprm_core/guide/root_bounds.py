"""Bounds of the root that a request leaves open: as wide as the task, no wider."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from pydantic import Field

from rbprm_core.guide.root_space import RootBounds
from rbprm_core.placement import Placement
from rbprm_core.scene import Surface

Array = NDArray[np.float64]
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
    places: Sequence[Placement], surfaces: Sequence[Surface], rule: BoundsRule
) -> RootBounds:
    """Bounds that hold some placements of the root, one at least, over all surfaces."""
    rings = [surface.polygon.boundary for surface in surfaces]
    points = np.vstack([*(place.position for place in places), *rings])
    angles = np.abs([_yaw_pitch_roll(place) for place in places])
    return RootBounds(
        low=points.min(axis=0) - rule.margin,
        high=points.max(axis=0) + rule.margin,
        half_ranges=np.maximum(angles.max(axis=0), [rule.yaw, rule.pitch, rule.roll]),
    )


def _yaw_pitch_roll(placement: Placement) -> Array:
    rotation = pin.Quaternion(placement.orientation).matrix()
    return np.asarray(pin.rpy.matrixToRpy(rotation)[::-1])
