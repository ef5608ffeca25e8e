"""A contact of a limb with a surface."""

from __future__ import annotations

from dataclasses import dataclass

from rbprm_core.arrays import Array


@dataclass(frozen=True, eq=False)
class Contact:
    """One contact of a limb, in the planning frame.

    Attributes:
        limb: index of the limb.
        position: (3,) contact point, or middle of the patch, metres.
        rotation: (3, 3) contact frame, columns t1, t2 and the outward normal n.
        points: (k, 3) points that carry forces: 1, or the 4 corners of the patch, metres.
        generators: (k, 4, 3) unit generators of the friction cone of each point.
        friction: friction coefficient.
        surface: id of the surface.
        spot: index of the limb's contact spot, whose frame and outline touch the surface.
    """

    limb: int
    position: Array
    rotation: Array
    points: Array
    generators: Array
    friction: float
    surface: str
    spot: int = 0

    @property
    def normal(self) -> Array:
        """Outward unit normal (3,) of the surface."""
        return self.rotation[:, 2]
