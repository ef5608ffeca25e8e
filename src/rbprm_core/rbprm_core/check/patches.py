"""The share of a planar contact's patch that lies on the environment, between its corners too."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from rbprm_core.arrays import Array, BoolArray
from rbprm_core.check.contact_placement import DISTANCE_BOUND
from rbprm_core.check.plan_environment import Environment
from rbprm_core.check.triangle_geometry import point_distances
from rbprm_core.check.violation import Kind, Violation
from rbprm_core.plan_record import ContactEntry, Vector3

SPACING = 5e-3  # metres between samples; finds every gap wider than this plus twice the bound
MAX_SAMPLES = 200  # along a side; patches are soles and palms
SLACK = 1e-9  # metres; rounding of samples between corners at exactly the bound


class Patches:
    """Measures the patches of planar contacts on one environment.

    Corners off the environment are violations of another kind (`Kind.OFF_ENVIRONMENT`). Here the
    edges and the interior are sampled: a patch over a gap, a hole or an inner corner of a surface
    may have all corners on surfaces and still overhang.

    Args:
        environment: environment of the plan.

    Attributes:
        overhanging: number of contacts so far, over all states, with a part off the environment.
        unsupported: greatest share so far of a patch's area off the environment, 0 to 1.
    """

    def __init__(self, environment: Environment) -> None:
        self._environment = environment
        self._shares: dict[tuple[Vector3, ...], tuple[float, bool]] = {}
        self.overhanging = 0
        self.unsupported = 0.0

    def violations(self, contact: ContactEntry, index: int) -> Iterator[Violation]:
        """Yield a violation if a patch overhangs with all its corners on the environment.

        Args:
            contact: contact to measure; contacts without a patch are skipped.
            index: index of its state.
        """
        if contact.type != "planar" or len(contact.points) != 4:
            return
        if contact.points not in self._shares:  # a kept contact is measured once
            self._shares[contact.points] = self._measure(np.array(contact.points))
        share, corners_lie = self._shares[contact.points]
        self.overhanging += share > 0
        self.unsupported = max(self.unsupported, share)
        if share > 0 and corners_lie:
            text = f"{share:.1%} of the patch more than {1e3 * DISTANCE_BOUND:.1f} mm from the"
            text += " environment, though its corners are not"
            yield Violation(index, contact.limb, Kind.OVERHANG, text)

    def _measure(self, corners: Array) -> tuple[float, bool]:
        """Return the share of a patch's area off the environment; whether its corners are on it.

        Args:
            corners: (4, 3) corners of the patch in order, metres, planning frame.
        """
        points, weights = _samples(corners)
        lifted = self._is_lifted(points.reshape(-1, 3)).reshape(weights.shape)
        corners_lie = not lifted[np.ix_((0, -1), (0, -1))].any()
        return float((weights * lifted).sum() / weights.sum()), corners_lie

    def _is_lifted(self, points: Array) -> BoolArray:
        """Return (n,) where a point (n, 3) is farther from the environment than the bound."""
        bound = DISTANCE_BOUND + SLACK
        left = np.arange(len(points))
        for k in self._environment.near(points.min(axis=0) - bound, points.max(axis=0) + bound):
            away = point_distances(self._environment.triangles[k], points[left]) > bound
            left = left[away]
            if not len(left):
                break
        lifted = np.zeros(len(points), dtype=bool)
        lifted[left] = True
        return lifted


def _samples(corners: Array) -> tuple[Array, Array]:
    """Return points (a, b, 3) over a patch (4, 3) with its edges, and area weights (a, b)."""
    sides = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)
    counts = [int(np.ceil(max(sides[k], sides[k + 2]) / SPACING)) + 1 for k in (0, 1)]
    u, v = (np.linspace(0.0, 1.0, min(max(count, 2), MAX_SAMPLES)) for count in counts)
    u_, v_ = u[:, None, None], v[None, :, None]
    first, second, third, fourth = corners
    points = (1 - v_) * ((1 - u_) * first + u_ * second) + v_ * ((1 - u_) * fourth + u_ * third)
    weights = np.ones((len(u), len(v)))  # trapezoidal rule: samples on an edge count half
    weights[[0, -1]] /= 2
    weights[:, [0, -1]] /= 2
    return points, weights
