"""Friction cones, each linearised from inside to a pyramid with four edges."""

from __future__ import annotations

import numpy as np

from rbprm_core.arrays import Array

MIN_FRICTION = 1e-4
"""Smaller coefficients of friction are raised to this value.

On level ground without friction, equilibrium would depend on the last digits of the normals: with
normals off by 1e-7 rad, the rounding of a mesh, no forces balance the weight. This value holds a
tilt of 0.1 mm/m.
"""


def cone_generators(rotation: Array, friction: float) -> Array:
    r"""Return the generators (4, 3) of the friction pyramid at a contact point, unit length.

    They are $n \pm \mu t_1$ and $n \pm \mu t_2$, each divided by $\sqrt{1 + \mu^2}$
    (Tonneau et al. 2018, section 5.1.1), in the order $+t_1, -t_1, +t_2, -t_2$.

    Args:
        rotation: (3, 3) orientation of the contact frame in the world. Its columns are the
            tangents $t_1$ and $t_2$ and the outward normal $n$ of the surface.
        friction: coefficient $\mu$ of Coulomb friction.
    """
    friction = max(friction, MIN_FRICTION)
    t1, t2, n = rotation.T
    rays = np.stack([n + friction * t1, n - friction * t1, n + friction * t2, n - friction * t2])
    return np.asarray(rays / np.sqrt(1 + friction * friction))
