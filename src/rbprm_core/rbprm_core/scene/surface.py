"""A contact surface: a planar polygon with an outward normal, friction, a kind and an id."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from rbprm_core.errors import InvalidInput
from rbprm_core.scene.polygon import Polygon, make_polygon
from rbprm_core.surface_kind import SurfaceKind
from rbprm_core.validation import MAX_FRICTION, finite_number

Array = NDArray[np.float64]
NotNegative = Annotated[float, Field(ge=0)]


@dataclass(frozen=True)
class Classification:
    """How a normal n decides what a surface is good for; z is up.

    Attributes:
        support: Support where ||z - n||^2 is less than this.
        lean: Lean where |n . z| is less than this.
        min_area: smaller surfaces are obstacles only, square metres.
    """

    support: NotNegative = 0.3
    lean: NotNegative = 0.1
    min_area: NotNegative = 0.002

    def kind(self, normal: Array, area: float) -> SurfaceKind:
        """Kind of a surface with a unit normal (3,) and an area."""
        if area < self.min_area:
            return SurfaceKind.OTHER
        if 2 - 2 * normal[2] < self.support:  # ||z - n||^2 of two unit vectors
            return SurfaceKind.SUPPORT
        if abs(normal[2]) < self.lean:
            return SurfaceKind.LEAN
        return SurfaceKind.OTHER


@dataclass(frozen=True, eq=False)
class Surface:
    """A contact surface; everything in the planning frame."""

    id: str
    polygon: Polygon
    friction: float
    kind: SurfaceKind

    @property
    def normal(self) -> Array:
        """Outward unit normal (3,)."""
        return self.polygon.plane.normal


def make_surface(
    identity: str,
    vertices: ArrayLike,
    friction: float,
    holes: tuple[ArrayLike, ...] = (),
    classification: Classification = Classification(),
    field: str = "surface",
) -> Surface:
    """A surface from a polygon given directly.

    Args:
        identity: unique id. vertices: (v, 3), counter-clockwise seen from outside, metres.
        friction: coefficient of Coulomb friction, 0 to `MAX_FRICTION`. holes: each (h, 3).
        field: name of the surface in errors.

    Raises:
        InvalidInput: see `make_polygon`; friction that is none; empty id.
    """
    if not identity:
        raise InvalidInput(f"{field}.id", identity, "must not be empty")
    friction = finite_number(f"{field}.friction", friction, low=0.0, high=MAX_FRICTION)
    polygon = make_polygon(vertices, holes, field)
    kind = classification.kind(polygon.plane.normal, polygon.area)
    return Surface(identity, polygon, friction, kind)
