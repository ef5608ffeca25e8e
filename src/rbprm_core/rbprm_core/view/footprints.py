"""Footprints: the contacts of a plan, each once, at the state in which it is made."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import trimesh

from rbprm_core.arrays import Array
from rbprm_core.plan_record import StateEntry
from rbprm_core.view.mesh_operations import frame_on

SAME_FOOTPRINT = 1.5e-3  # metres; the plan format lets a kept contact drift by this much


@dataclass(frozen=True, eq=False)
class Footprint:
    """A contact at the state in which it is made, in the planning frame.

    Attributes:
        limb: name of the limb.
        state: index of the first state that has the contact.
        position: (3,) contact point, metres.
        normal: (3,) outward unit normal of the surface.
        corners: (k, 3) corners of the patch in order around it, metres; empty for a point contact.
    """

    limb: str
    state: int
    position: Array
    normal: Array
    corners: Array

    @property
    def radius(self) -> float:
        """Distance from the contact point to the farthest corner, metres; 0 for a point contact."""
        return float(np.linalg.norm(self.corners - self.position, axis=1).max(initial=0))


def footprints(states: Sequence[StateEntry]) -> tuple[Footprint, ...]:
    """Return one footprint for each contact that a state makes or moves, ordered by state.

    Args:
        states: states of a plan.
    """
    found: list[Footprint] = []
    last: dict[str, Footprint] = {}
    for index, state in enumerate(states):
        current: dict[str, Footprint] = {}
        for contact in state.contacts:
            position = np.array(contact.position)
            mark = last.get(contact.limb)
            if mark is None or np.linalg.norm(mark.position - position) > SAME_FOOTPRINT:
                normal = np.array(contact.normal) / np.linalg.norm(contact.normal)
                corners = _sorted_corners(np.array(contact.points).reshape(-1, 3), normal)
                mark = Footprint(contact.limb, index, position, normal, corners)
                found.append(mark)
            current[contact.limb] = mark
        last = current
    return tuple(found)


def _sorted_corners(points: Array, normal: Array) -> Array:
    """Return corners (k, 3) counter-clockwise about the normal; none if there are fewer than 3."""
    if len(points) < 3:
        return np.empty((0, 3))
    flat = trimesh.transform_points(points, np.linalg.inv(frame_on(points[0], normal)))
    x, y = (flat - flat.mean(axis=0))[:, :2].T
    return points[np.argsort(np.arctan2(y, x))]
