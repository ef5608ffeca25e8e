"""A contact of a limb with a surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Contact:
    """One contact of a limb, in the planning frame.

    Attributes:
        limb: index of the limb.
        position: (3,) contact point, or middle of the patch, metres.
        rotation: (3, 3) contact frame, columns t1, t2 and the outward normal n.
        points: (k, 3) points that carry forces: 1, or the 4 corners of the patch, metres.
        generators: (k, 4, 3) unit rays of the friction cone of each point.
        friction: coefficient. surface: id of the surface.
    """

    limb: int
    position: Array
    rotation: Array
    points: Array
    generators: Array
    friction: float
    surface: str

    @property
    def normal(self) -> Array:
        """Outward unit normal (3,)."""
        return self.rotation[:, 2]
