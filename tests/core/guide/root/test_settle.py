"""Settling of a guide: the root moves to its reference height where that is valid."""

from __future__ import annotations

import numpy as np
import pytest

from rbprm_core.budget import Budget
from rbprm_core.errors import Cancelled
from rbprm_core.guide.root import EdgeTest, GuidePath, Reachability, RootBounds, RootSpace, settle
from rbprm_core.guide.root.settle import Settler
from rbprm_core.robot.data import RobotData
from rbprm_core.scene import Scene, make_surface

LEGS = ("lf_leg", "rf_leg", "lh_leg", "rh_leg")
FLAT = [[-2, -3, 0], [6, -3, 0], [6, 3, 0], [-2, 3, 0]]


def straight_path(z: float, length: float = 3.0) -> GuidePath:
    return GuidePath(np.array([[0, 0, z, 0, 0, 0, 1], [length, 0, z, 0, 0, 0, 1.0]]))


class Ground:
    """Settler on polygons (flat ground by default), with bounds of the root's height in metres."""

    def __init__(
        self, data: RobotData, *rings: list[list[float]], low: float = 0.3, high: float = 1.0
    ) -> None:
        surfaces = [make_surface(f"g{k}", ring, 0.5) for k, ring in enumerate(rings or [FLAT])]
        scene = Scene(surfaces)
        box = np.array([[-3, 5], [-1, 1], [low, high]])
        space = RootSpace(RootBounds(box[:, 0], box[:, 1], np.ones(3)), np.zeros(0), np.zeros(0))
        self.edge = EdgeTest(space, Reachability(data, scene, LEGS), 0.05)
        self.settler = Settler(data, scene, LEGS)

    def settle(self, path: GuidePath) -> GuidePath:
        return self.settler.settle(path, self.edge, Budget())


@pytest.mark.parametrize("z", [0.5, 0.7])
def test_the_root_rides_at_its_reference_height(hyq_data: RobotData, z: float) -> None:
    settled = Ground(hyq_data).settle(straight_path(z))
    middle = settled.root(settled.length / 2)
    assert middle[2] == pytest.approx(hyq_data.height, abs=5e-3)
    assert np.array_equal(settled.nodes[0], straight_path(z).nodes[0])
    assert settled.nodes[-1] == pytest.approx(straight_path(z).nodes[-1])


def test_a_settled_path_is_valid(hyq_data: RobotData) -> None:
    ground = Ground(hyq_data)
    settled = ground.settle(straight_path(0.5))
    for a, b in zip(settled.nodes, settled.nodes[1:], strict=False):
        assert ground.edge.holds(a, b)


def test_bounds_are_kept(hyq_data: RobotData) -> None:
    settled = Ground(hyq_data, high=0.52).settle(straight_path(0.5))
    assert settled.nodes[:, 2].max() <= 0.52 + 1e-6


def test_a_short_path_stays(hyq_data: RobotData) -> None:
    path = straight_path(0.5, 0.1)
    assert Ground(hyq_data).settle(path) is path


def test_the_caller_may_stop_it(hyq_data: RobotData) -> None:
    ground = Ground(hyq_data)
    with pytest.raises(Cancelled):
        ground.settler.settle(straight_path(0.5), ground.edge, Budget(cancelled=lambda: True))


def test_over_a_beam_the_root_goes_to_its_middle(hyq_data: RobotData) -> None:
    bank = [[-2, -2, 0], [0, -2, 0], [0, 2, 0], [-2, 2, 0]]
    beam = [[0.1, 0.3, 0], [2.9, 0.3, 0], [2.9, 0.55, 0], [0.1, 0.55, 0]]
    other = [[3, -2, 0], [6, -2, 0], [6, 2, 0], [3, 2, 0]]
    path = GuidePath(np.array([[-1, 0.2, 0.6, 0, 0, 0, 1], [4, 0.2, 0.6, 0, 0, 0, 1.0]]))
    settled = Ground(hyq_data, bank, beam, other).settle(path)
    middle = settled.roots(np.linspace(0.4, 0.6, 9) * settled.length)
    assert middle[:, 1] == pytest.approx(0.425, abs=0.06)
    assert settled.nodes[[0, -1]] == pytest.approx(path.nodes)


def test_a_hole_neither_hurries_nor_delays_the_root(hyq_data: RobotData) -> None:
    bank = [[-2, -3, 0], [1, -3, 0], [1, 3, 0], [-2, 3, 0]]
    other = [[1.4, -3, 0], [6, -3, 0], [6, 3, 0], [1.4, 3, 0]]
    settled = Ground(hyq_data, bank, other).settle(straight_path(0.6))
    assert np.abs(settled.nodes[:, 1]).max() < 1e-6
    assert (np.diff(settled.nodes[:, 0]) > 0).all()


@pytest.mark.parametrize("rise", [0.3, 0.45])
def test_before_a_high_step_the_root_stays_where_the_hind_feet_reach_down(
    hyq_data: RobotData, rise: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    edge, length = 1.5, 3.0
    low = [[-2, -3, 0], [edge, -3, 0], [edge, 3, 0], [-2, 3, 0]]
    high = [[edge, -3, rise], [6, -3, rise], [6, 3, rise], [edge, 3, rise]]
    path = GuidePath(np.array([[0, 0, 0.6, 0, 0, 0, 1], [length, 0, 0.6 + rise, 0, 0, 0, 1.0]]))
    arc_lengths = np.linspace(0, path.length, 31)
    heights = []
    for stretch in (settle.STRETCH, 100.0):
        monkeypatch.setattr(settle, "STRETCH", stretch)
        roots = path.roots(arc_lengths)
        heights.append(roots[:, 2] + Ground(hyq_data, low, high).settler._moves(roots)[:, 2])
    held, free = heights
    depths = [-corners[:, 2].min() for corners in hyq_data.workspaces]  # below the root
    reach = min(depths) + hyq_data.robot.limbs[0].radius
    feet = path.roots(arc_lengths)[:, 0] - 0.37  # x of the hind feet
    behind = feet < edge - 0.2
    assert (held[behind] <= 0.96 * reach + 0.01).all()
    assert (free - held).max() > 0.05
    assert held[feet < 0.2] == pytest.approx(free[feet < 0.2], abs=0.03)
    away = feet > edge + 0.5
    assert held[away] == pytest.approx(free[away], abs=1e-6)
