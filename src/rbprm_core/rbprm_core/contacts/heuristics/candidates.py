"""Input of the heuristics."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rbprm_core.arrays import Array


@dataclass(frozen=True, eq=False)
class Candidates:
    """m contact candidates of one limb with n joints; vectors in the limb's base frame.

    Attributes:
        joints: (m, n) joint positions of the limb, radians or metres.
        reference: (n,) joint positions of the limb in the reference posture.
        low: (n,) lower joint limits.
        high: (n,) upper joint limits.
        grams: (m, 3, 3) $J J^T$ of the limb configurations (Tonneau et al. 2018, section 5.2.1).
        manipulability: (m,) manipulability of the limb configurations (equation 17 there).
        normals: (m, 3) outward unit normals of the surfaces.
        friction: (m,) friction coefficients of the surfaces.
        centers: (m, 3) contact centres, metres.
        nominal: (3,) contact centre of the reference posture, see the heuristic `nominal`, metres.
        direction: (3,) unit direction of the root's motion; zero where the root rests.
        persistence: computes the share (m,) of the roots ahead at which each candidate stays in
            the workspace.
        rng: random generator of the request.
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
