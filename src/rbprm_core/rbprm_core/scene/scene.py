"""The scene: contact surfaces and obstacles, held as arrays for queries on many points at once."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import coal
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from rbprm_core.errors import InvalidInput
from rbprm_core.scene.surface import Surface
from rbprm_core.surface_kind import SurfaceKind

Array = NDArray[np.float64]

MIN_TOGETHER = 8  # triangles; fewer in a shape prune no better
MAX_SHAPES = 16  # so many boxes are compared faster than pairs of bodies are set up for more


@dataclass(frozen=True, eq=False)
class Pieces:
    """Convex pieces of surfaces as arrays; p pieces, e edges at most.

    Attributes:
        surface: (p,) index of the surface of each piece.
        friction: (p,) coefficients.
        normals: (p, 3) outward. offsets: (p,) with n . x = offset on the plane.
        edge_normals: (p, e, 3) inward, in the plane; edge_offsets: (p, e): inside where
            edge_normal . x >= offset. Missing edges are zero with offset minus infinity.
        outer: (p, e) True where the edge lies on the surface's boundary.
        low, high: (p, 3) bounding boxes.
    """

    surface: NDArray[np.int_]
    friction: Array
    normals: Array
    offsets: Array
    edge_normals: Array
    edge_offsets: Array
    outer: NDArray[np.bool_]
    low: Array
    high: Array


class Scene:
    """Contact surfaces and obstacles; never changed, an edit makes a new one.

    Args:
        surfaces: with unique ids.
        obstacles: (n, 3, 3) triangles of obstacles that are no contact surfaces.

    Raises:
        InvalidInput: two surfaces of the same id, or nothing at all.
    """

    def __init__(self, surfaces: Iterable[Surface], obstacles: Array | None = None) -> None:
        self.surfaces = tuple(surfaces)
        self._obstacles = np.zeros((0, 3, 3)) if obstacles is None else obstacles
        self.index = {surface.id: i for i, surface in enumerate(self.surfaces)}
        self._pieces: dict[tuple[SurfaceKind, ...], Pieces] = {}
        self._meshes: dict[tuple[SurfaceKind, ...], coal.BVHModelOBBRSS | None] = {}
        if len(self.index) != len(self.surfaces):
            ids = [surface.id for surface in self.surfaces]
            twice = next(i for i in ids if ids.count(i) > 1)
            raise InvalidInput("surfaces", twice, "two surfaces have this id")
        if not self.surfaces and not len(self._obstacles):
            raise InvalidInput("environment", "empty", "has neither surfaces nor meshes")

    @property
    def obstacles(self) -> Array:
        """Triangles (n, 3, 3) of obstacles that are no contact surfaces."""
        return self._obstacles

    def edited(self, changed: Iterable[Surface] = (), removed: Iterable[str] = ()) -> Scene:
        """The scene with surfaces added (new id), modified (known id) or removed.

        Raises:
            InvalidInput: a removed id that is not there.
        """
        kept = {surface.id: surface for surface in self.surfaces}
        for identity in removed:
            if kept.pop(identity, None) is None:
                raise InvalidInput("removed", identity, "no surface has this id")
        kept.update({surface.id: surface for surface in changed})
        return Scene(kept.values(), self._obstacles)

    @cached_property
    def boxes(self) -> tuple[Array, Array]:
        """Low and high corners (s, 3) of the surfaces' bounding boxes."""
        outlines = [surface.polygon.boundary for surface in self.surfaces]
        if not outlines:
            return np.zeros((0, 3)), np.zeros((0, 3))
        ends = np.cumsum([0, *(len(outline) for outline in outlines[:-1])])
        points = np.concatenate(outlines)
        return np.minimum.reduceat(points, ends), np.maximum.reduceat(points, ends)

    @cached_property
    def triangles(self) -> Array:
        """Triangles (n, 3, 3) of everything that can be hit: obstacles and surfaces."""
        return np.concatenate(
            [self._obstacles, fans([p for s in self.surfaces for p in s.polygon.pieces])]
        )

    @cached_property
    def shape(self) -> coal.BVHModelOBBRSS:
        """Everything that can be hit, as one coal mesh."""
        return mesh_shape(self.triangles)

    @cached_property
    def shapes(self) -> tuple[coal.BVHModelOBBRSS, ...]:
        """Everything that can be hit, as coal meshes of triangles that are near to each other."""
        most = max(MIN_TOGETHER, -(-len(self.triangles) // MAX_SHAPES))
        return tuple(mesh_shape(part) for part in _split(self.triangles, most))

    def surfaces_shape(self, kinds: tuple[SurfaceKind, ...]) -> coal.BVHModelOBBRSS | None:
        """The surfaces of some kinds as one coal mesh; None where there is none."""
        if kinds not in self._meshes:
            chosen = [p for s in self.surfaces if s.kind in kinds for p in s.polygon.pieces]
            self._meshes[kinds] = mesh_shape(fans(chosen)) if chosen else None
        return self._meshes[kinds]

    def pieces(self, kinds: tuple[SurfaceKind, ...]) -> Pieces:
        """The convex pieces of the surfaces of some kinds."""
        kept = self._pieces.get(kinds)
        if kept is not None:
            return kept
        chosen = [
            (i, piece, outer)
            for i, surface in enumerate(self.surfaces)
            if surface.kind in kinds
            for piece, outer in zip(
                surface.polygon.pieces, surface.polygon.outer_edges, strict=True
            )
        ]
        return self._pieces.setdefault(kinds, _stack(self.surfaces, chosen))

    def encloses(self, point: Array) -> bool:
        """True where a point (3,) lies inside a closed part of the scene."""
        solid = _solid_angles(self.triangles - point)
        totals = np.bincount(self._components, weights=solid)
        # A closed part around the point turns once: 1 where it faces outwards, -1 where it faces
        # inwards, as the walls of a room do. An open one, such as the ground, at most half a turn.
        return bool((totals > 0.75).any())

    @cached_property
    def _components(self) -> NDArray[np.int_]:
        """(n,) label of the connected part that each triangle belongs to."""
        corners = np.round(self.triangles.reshape(-1, 3) / 1e-6).astype(np.int64)
        _, vertex = np.unique(corners, axis=0, return_inverse=True)
        return _labels(vertex.reshape(-1, 3))


def mesh_shape(triangles: Array) -> coal.BVHModelOBBRSS:
    """Triangles (n, 3, 3) as a coal mesh."""
    shape = coal.BVHModelOBBRSS()
    shape.beginModel(len(triangles), 3 * len(triangles))
    shape.addVertices(np.ascontiguousarray(triangles.reshape(-1, 3)))
    shape.addTriangles(np.arange(3 * len(triangles), dtype=np.int64).reshape(-1, 3))
    shape.endModel()
    return shape


def _split(triangles: Array, most: int) -> list[Array]:
    """Triangles (n, 3, 3) halved by place until no part has more than `most`."""
    if len(triangles) <= most:
        return [triangles]
    middles = triangles.mean(axis=1)
    axis = int(np.argmax(np.ptp(middles, axis=0)))
    order = np.argsort(middles[:, axis], kind="stable")
    half = len(order) // 2
    return [
        *_split(triangles[order[:half]], most),
        *_split(triangles[order[half:]], most),
    ]


def fans(pieces: Sequence[Array]) -> Array:
    """Triangles (n, 3, 3) of convex polygons (m, 3), all at once: scenes have thousands of them."""
    if not pieces:
        return np.zeros((0, 3, 3))
    counts, starts = _sizes(pieces)
    each = counts - 2
    first = np.repeat(starts, each)
    second = first + 1 + np.arange(each.sum()) - np.repeat(np.cumsum(each) - each, each)
    return np.asarray(np.concatenate(pieces)[np.column_stack([first, second, second + 1])])


def _sizes(pieces: Sequence[Array]) -> tuple[NDArray[np.int_], NDArray[np.int_]]:
    """Number of corners (p,) of each piece, and where its first is among the corners of all."""
    counts = np.array([len(piece) for piece in pieces])
    return counts, np.cumsum(counts) - counts


def _stack(
    surfaces: tuple[Surface, ...], chosen: list[tuple[int, Array, NDArray[np.bool_]]]
) -> Pieces:
    surface = np.array([i for i, _, _ in chosen], dtype=int)
    normals = np.array([surfaces[i].normal for i in surface]).reshape(-1, 3)
    friction = np.array([surfaces[i].friction for i in surface])
    if not chosen:
        edges, none = np.zeros((0, 0)), np.zeros((0, 3))
        return Pieces(
            surface, friction, normals, friction, np.zeros((0, 0, 3)), edges, edges > 0, none, none
        )
    pieces = [piece for _, piece, _ in chosen]
    counts, starts = _sizes(pieces)
    corners = np.concatenate(pieces)
    owner = np.repeat(np.arange(len(pieces)), counts)
    after = np.arange(1, len(corners) + 1)
    after[starts + counts - 1] = starts
    inward = np.cross(normals[owner], corners[after] - corners)
    inward /= np.linalg.norm(inward, axis=1)[:, None]
    place = owner, np.arange(len(corners)) - starts[owner]
    edge_normals = np.zeros((len(pieces), counts.max(), 3))
    edge_offsets = np.full(edge_normals.shape[:2], -np.inf)
    outer = np.zeros(edge_normals.shape[:2], dtype=bool)
    edge_normals[place] = inward
    edge_offsets[place] = (inward * corners).sum(axis=1)
    outer[place] = np.concatenate([is_outer for _, _, is_outer in chosen])
    return Pieces(
        surface=surface,
        friction=friction,
        normals=normals,
        offsets=np.einsum("ij,ij->i", normals, corners[starts]),
        edge_normals=edge_normals,
        edge_offsets=edge_offsets,
        outer=outer,
        low=np.minimum.reduceat(corners, starts),
        high=np.maximum.reduceat(corners, starts),
    )


def _solid_angles(triangles: Array) -> Array:
    """Share of a full turn (n,) that triangles (n, 3, 3) cover seen from the origin.

    Van Oosterom and Strackee (1983): tan(omega / 2) from the corners' directions.
    """
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
    top = np.einsum("ij,ij->i", a, np.cross(b, c))
    dots = [np.einsum("ij,ij->i", u, v) for u, v in ((a, b), (b, c), (c, a))]
    bottom = la * lb * lc + dots[0] * lc + dots[1] * la + dots[2] * lb
    return np.asarray(np.arctan2(top, bottom) / (2 * np.pi))


def _labels(faces: NDArray[np.int_]) -> NDArray[np.int_]:
    """Component label (n,) of each face (n, 3): faces that share a vertex are connected."""
    size = int(faces.max()) + 1 if len(faces) else 0
    rows, columns = faces[:, [0, 1]].ravel(), faces[:, [1, 2]].ravel()
    graph = coo_array((np.ones(len(rows)), (rows, columns)), shape=(size, size))
    _, labels = connected_components(graph, directed=False)
    return np.asarray(labels[faces[:, 0]]) if len(faces) else np.zeros(0, dtype=int)
