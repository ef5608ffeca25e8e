"""How much of a contact's patch lies on the environment, between its corners too."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from rbprm_core.check.environment import CONTACT_BOUND, Environment, point_distances
from rbprm_core.check.report import Kind, Violation
from rbprm_core.plan_record import ContactEntry, Vector3

SPACING = 5e-3  # metres between samples: a gap of twice the bound and that much is not missed
MAX_SAMPLES = 200  # along a side; patches are soles and palms
SLACK = 1e-9  # rounding of points between corners that were held to the same bound


class Patches:
    """Measures the patches of planar contacts on one environment.

    Corners off the environment are violations by themselves (`Kind.OFF_ENVIRONMENT`). Here the
    edges and the interior are sampled: a patch over a gap, a hole or an inner corner of a surface
    has every corner on something and overhangs all the same.

    Attributes:
        overhanging: patches of states' contacts met so far of which a part is on nothing.
        unsupported: the greatest share of a patch's area on nothing met so far, 0 to 1.
    """

    def __init__(self, environment: Environment) -> None:
        self._environment = environment
        self._shares: dict[tuple[Vector3, ...], tuple[float, bool]] = {}
        self.overhanging = 0
        self.unsupported = 0.0

    def violations(self, contact: ContactEntry, index: int) -> Iterator[Violation]:
        """A patch that overhangs with all its corners on the environment."""
        if contact.type != "planar" or len(contact.points) != 4:
            return
        if contact.points not in self._shares:  # a kept contact is one and the same
            self._shares[contact.points] = self._measured(np.array(contact.points))
        share, corners_lie = self._shares[contact.points]
        self.overhanging += share > 0
        self.unsupported = max(self.unsupported, share)
        if share > 0 and corners_lie:
            text = f"{share:.1%} of the patch more than {1e3 * CONTACT_BOUND:.1f} mm from the"
            text += " environment, though its corners are not"
            yield Violation(index, contact.limb, Kind.OVERHANG, text)

    def _measured(self, corners: NDArray[np.float64]) -> tuple[float, bool]:
        """Share of the area of a patch (4, 3) on nothing, and whether all its corners lie."""
        points, weights = _samples(corners)
        lifted = self._lifted(points.reshape(-1, 3)).reshape(weights.shape)
        corners_lie = not lifted[np.ix_((0, -1), (0, -1))].any()
        return float((weights * lifted).sum() / weights.sum()), corners_lie

    def _lifted(self, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        """True (n,) where a point (n, 3) is farther from the environment than a contact may be."""
        bound = CONTACT_BOUND + SLACK
        left = np.arange(len(points))
        for k in self._environment.near(points.min(axis=0) - bound, points.max(axis=0) + bound):
            away = point_distances(self._environment.triangles[k], points[left]) > bound
            left = left[away]
            if not len(left):
                break
        lifted = np.zeros(len(points), dtype=bool)
        lifted[left] = True
        return lifted


def _samples(corners: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Points (a, b, 3) over a patch (4, 3), its edges included, and the share of each (a, b)."""
    sides = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)
    counts = [int(np.ceil(max(sides[k], sides[k + 2]) / SPACING)) + 1 for k in (0, 1)]
    u, v = (np.linspace(0.0, 1.0, min(max(count, 2), MAX_SAMPLES)) for count in counts)
    u_, v_ = u[:, None, None], v[None, :, None]
    first, second, third, fourth = corners
    points = (1 - v_) * ((1 - u_) * first + u_ * second) + v_ * ((1 - u_) * fourth + u_ * third)
    weights = np.ones((len(u), len(v)))  # trapezoids: an edge stands for half a strip
    weights[[0, -1]] /= 2
    weights[:, [0, -1]] /= 2
    return points, weights
