"""What differs between two scenes, as boxes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rbprm_core.scene.scene import Scene, fans
from rbprm_core.scene.surface import Surface

Array = NDArray[np.float64]


def changed_boxes(old: Scene, new: Scene) -> Array:
    """Bounding boxes (n, 2, 3), low and high corners, of all that one scene has and the other not.

    Surfaces are the same where id, geometry, kind and friction agree; obstacles, triangle by
    triangle.
    """
    changed = []
    for identity in {**old.index, **new.index}:
        before, after = _surface(old, identity), _surface(new, identity)
        if before is not after and not (before and after and _same(before, after)):
            changed += [s.polygon.boundary for s in (before, after) if s is not None]
    if old.obstacles is not new.obstacles:
        rows = [{t.tobytes(): t for t in scene.obstacles} for scene in (old, new)]
        changed += [{**rows[0], **rows[1]}[k] for k in rows[0].keys() ^ rows[1].keys()]
    return np.array([[c.min(axis=0), c.max(axis=0)] for c in changed]).reshape(-1, 2, 3)


def added_triangles(old: Scene, new: Scene) -> list[Array]:
    """Triangles (n, 3, 3) that can be hit in the new scene and were not there in the old one.

    One array a surface that is new or was changed, and one for all such obstacles.
    """
    added = []
    for identity, index in new.index.items():
        before, after = _surface(old, identity), new.surfaces[index]
        if before is not after and not (before and _same(before, after)):
            added.append(fans(after.polygon.pieces))
    if old.obstacles is not new.obstacles:
        known = {triangle.tobytes() for triangle in old.obstacles}
        fresh = [triangle for triangle in new.obstacles if triangle.tobytes() not in known]
        if fresh:
            added.append(np.array(fresh))
    return added


def _surface(scene: Scene, identity: str) -> Surface | None:
    index = scene.index.get(identity)
    return None if index is None else scene.surfaces[index]


def _same(a: Surface, b: Surface) -> bool:
    rings = [(s.polygon.boundary, *s.polygon.holes, s.normal) for s in (a, b)]
    return (
        (a.kind, a.friction, len(rings[0])) == (b.kind, b.friction, len(rings[1]))
        and all(np.array_equal(r, s) for r, s in zip(*rings, strict=True))
    )  # fmt: skip
