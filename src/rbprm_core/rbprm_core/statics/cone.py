"""Friction cones, linearised from inside by four unit rays a contact point."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

MIN_FRICTION = 1e-4
"""Less friction counts as this much.

Whether level ground without any holds a robot would hang on the last digits of its normals: at
1e-7 rad, the rounding of a mesh, nothing balances the weight. This much holds a tilt of 0.1 mm/m.
"""


def cone_generators(rotation: Array, friction: float) -> Array:
    """Generators (4, 3) of a point's friction cone, unit length (section 5.1.1).

    n + mu t1, n - mu t1, n + mu t2, n - mu t2, each divided by its length.

    Args:
        rotation: (3, 3) contact frame in the world, columns t1, t2, n with n the outward normal.
        friction: coefficient mu of Coulomb friction.
    """
    friction = max(friction, MIN_FRICTION)
    t1, t2, n = rotation.T
    rays = np.stack([n + friction * t1, n - friction * t1, n + friction * t2, n - friction * t2])
    return np.asarray(rays / np.sqrt(1 + friction * friction))
