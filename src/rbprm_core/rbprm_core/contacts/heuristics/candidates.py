"""What a heuristic may look at."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Candidates:
    """m contact candidates of one limb of n joints; vectors in the limb's base frame.

    Attributes:
        joints: (m, n) limb configurations, radians or metres.
        reference: (n,) the limb in the reference posture. low, high: (n,) joint limits.
        grams: (m, 3, 3) J J^T of the limb configurations (section 5.2.1).
        manipulability: (m,) of the limb configurations (equation 17).
        normals: (m, 3) outward normals of the surfaces. friction: (m,) their coefficients.
        centers: (m, 3) contact centres, metres. nominal: (3,) the centre that would suit best.
        direction: (3,) unit local direction of the root's motion; zero where it stands still.
        persistence: tells for how much of the guide ahead each candidate stays in reach, (m,).
        rng: the request's generator, for heuristics that draw.
    """

    joints: Array
    reference: Array
    low: Array
    high: Array
    grams: Array
    manipulability: Array
    normals: Array
    friction: Array
    centers: Array
    nominal: Array
    direction: Array
    persistence: Callable[[], Array]
    rng: np.random.Generator

    def __len__(self) -> int:
        return len(self.normals)
