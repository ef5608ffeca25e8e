"""Root bounds for requests that give none: as wide as the task needs, and no wider."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
import pinocchio as pin
from pydantic import Field

from rbprm_core.arrays import Array
from rbprm_core.guide.root_space import RootBounds
from rbprm_core.placement import Placement
from rbprm_core.scene import Surface

Angle = Annotated[float, Field(ge=0, le=math.pi)]


@dataclass(frozen=True)
class BoundsRule:
    """Rule by which root bounds are derived.

    Attributes:
        margin: width added around the box of start, goal and all surfaces, metres.
        yaw: minimum half range about z, radians; start and goal widen it.
        pitch: minimum half range about y, radians; start and goal widen it.
        roll: minimum half range about x, radians; start and goal widen it.
    """

    margin: Annotated[float, Field(ge=0)] = 1.0
    yaw: Angle = 0.4
    pitch: Angle = 0.3
    roll: Angle = 0.3


def derived_bounds(
    places: Sequence[Placement], surfaces: Sequence[Surface], rule: BoundsRule
) -> RootBounds:
    """Root bounds that contain some placements of the root and the space over all surfaces.

    Args:
        places: placements of the root in the planning frame, at least one.
        surfaces: surfaces in the planning frame.
        rule: margin and minimum half ranges.
    """
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
