"""A contact surface: a planar polygon with an outward normal, friction, a kind and an id."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from numpy.typing import ArrayLike
from pydantic import Field

from rbprm_core.arrays import Array
from rbprm_core.errors import InvalidInput
from rbprm_core.scene.polygon import Polygon, make_polygon
from rbprm_core.surface_kind import SurfaceKind
from rbprm_core.validation import MAX_FRICTION, finite_number

NotNegative = Annotated[float, Field(ge=0)]


@dataclass(frozen=True)
class Classification:
    r"""Rules that assign a kind to a surface from its normal $n$ and its area; $z$ is up.

    Attributes:
        support: a surface is of kind Support where $\lVert z - n \rVert^2$ is less than this.
        lean: a surface that is not Support is of kind Lean where $|n \cdot z|$ is less than this.
        min_area: smaller surfaces are obstacles only, square metres.
    """

    support: NotNegative = 0.3
    lean: NotNegative = 0.1
    min_area: NotNegative = 0.002

    def kind(self, normal: Array, area: float) -> SurfaceKind:
        """Return the kind of a surface.

        Args:
            normal: (3,) outward unit normal, planning frame.
            area: area, square metres.
        """
        if area < self.min_area:
            return SurfaceKind.OTHER
        if 2 - 2 * normal[2] < self.support:  # ||z - n||^2 for unit vectors
            return SurfaceKind.SUPPORT
        if abs(normal[2]) < self.lean:
            return SurfaceKind.LEAN
        return SurfaceKind.OTHER


@dataclass(frozen=True, eq=False)
class Surface:
    """A contact surface.

    Attributes:
        id: unique name in a scene.
        polygon: outline, metres, planning frame.
        friction: coefficient of Coulomb friction.
        kind: what the surface may be used for.
    """

    id: str
    polygon: Polygon
    friction: float
    kind: SurfaceKind

    @property
    def normal(self) -> Array:
        """Outward unit normal (3,), planning frame."""
        return self.polygon.plane.normal


def make_surface(
    identity: str,
    vertices: ArrayLike,
    friction: float,
    holes: tuple[ArrayLike, ...] = (),
    classification: Classification = Classification(),
    field: str = "surface",
) -> Surface:
    """Return a surface with a given polygon, and with its kind from the classification.

    Args:
        identity: id of the surface, unique in a scene.
        vertices: (v, 3) boundary, counter-clockwise seen from outside, metres, planning frame.
        friction: coefficient of Coulomb friction, 0 to `MAX_FRICTION`.
        holes: vertices of each hole, (h, 3), metres, planning frame.
        classification: rules that assign the kind.
        field: name of the surface in errors.

    Raises:
        InvalidInput: the polygon is not valid (see `make_polygon`), the friction is not a number in
            its range, or the id is empty.
    """
    if not identity:
        raise InvalidInput(f"{field}.id", identity, "must not be empty")
    friction = finite_number(f"{field}.friction", friction, low=0.0, high=MAX_FRICTION)
    polygon = make_polygon(vertices, holes, field)
    kind = classification.kind(polygon.plane.normal, polygon.area)
    return Surface(identity, polygon, friction, kind)
