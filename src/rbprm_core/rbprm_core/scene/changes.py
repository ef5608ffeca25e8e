"""Differences between two scenes, as bounding boxes and as triangles."""

from __future__ import annotations

import numpy as np

from rbprm_core.arrays import Array
from rbprm_core.scene.scene import Scene
from rbprm_core.scene.surface import Surface
from rbprm_core.scene.triangles import fan_triangles


def changed_boxes(old: Scene, new: Scene) -> Array:
    """Return the bounding boxes (n, 2, 3) of everything that only one of two scenes has.

    Surfaces are the same where id, geometry, kind and friction agree. Obstacles are compared
    triangle by triangle.

    Args:
        old: scene before the change.
        new: scene after the change.

    Returns:
        Lowest and highest corner of each box, metres, planning frame.
    """
    changed = []
    for identity in {**old.index, **new.index}:
        before, after = _surface(old, identity), _surface(new, identity)
        if before is not after and not (before and after and _is_same(before, after)):
            changed += [s.polygon.boundary for s in (before, after) if s is not None]
    if old.obstacles is not new.obstacles:
        rows = [{t.tobytes(): t for t in scene.obstacles} for scene in (old, new)]
        changed += [{**rows[0], **rows[1]}[k] for k in rows[0].keys() ^ rows[1].keys()]
    return np.array([[c.min(axis=0), c.max(axis=0)] for c in changed]).reshape(-1, 2, 3)


def added_triangles(old: Scene, new: Scene) -> list[Array]:
    """Return the triangles of everything in the new scene that the old one does not have.

    Args:
        old: scene before the change.
        new: scene after the change.

    Returns:
        Arrays (n, 3, 3), metres, planning frame: one for each surface that was added or changed,
        and one for all added obstacles if there are any.
    """
    added = []
    for identity, index in new.index.items():
        before, after = _surface(old, identity), new.surfaces[index]
        if before is not after and not (before and _is_same(before, after)):
            added.append(fan_triangles(after.polygon.pieces))
    if old.obstacles is not new.obstacles:
        known = {triangle.tobytes() for triangle in old.obstacles}
        fresh = [triangle for triangle in new.obstacles if triangle.tobytes() not in known]
        if fresh:
            added.append(np.array(fresh))
    return added


def _surface(scene: Scene, identity: str) -> Surface | None:
    """Return the surface with an id, None if the scene has none."""
    index = scene.index.get(identity)
    return None if index is None else scene.surfaces[index]


def _is_same(a: Surface, b: Surface) -> bool:
    """Return whether kind, friction and geometry of two surfaces are equal."""
    rings = [(s.polygon.boundary, *s.polygon.holes, s.normal) for s in (a, b)]
    return (
        (a.kind, a.friction, len(rings[0])) == (b.kind, b.friction, len(rings[1]))
        and all(np.array_equal(r, s) for r, s in zip(*rings, strict=True))
    )  # fmt: skip
