"""The velocity that a limb can give its effector along the motion."""

from __future__ import annotations

import numpy as np

from rbprm_core.arrays import Array
from rbprm_core.contacts.heuristics.candidates import Candidates


def velocity(candidates: Candidates) -> Array:
    r"""Velocity ratio (m,) of each candidate, $[m^T (J J^T)^{-1} m]^{-1/2} (\mu\, n^T m)$.

    m is opposite to the local motion, as in EFORT (Tonneau et al. 2018, equation 16). With
    $(J J^T)^{-1} = \mathrm{adj}(J J^T) / \det(J J^T)$ the first factor is
    $h_w / \sqrt{m^T \mathrm{adj}(J J^T) m}$: zero, not undefined, at a singularity.

    Args:
        candidates: the candidates.
    """
    m = -candidates.direction
    first, second, third = np.moveaxis(candidates.grams, 1, 0)
    adjugate = np.cross(second, third) * m[0]
    adjugate += np.cross(third, first) * m[1] + np.cross(first, second) * m[2]
    ratio = candidates.manipulability / np.sqrt(np.maximum(adjugate @ m, 0.0) + 1e-12)
    return np.asarray(candidates.friction * (candidates.normals @ m) * ratio)
