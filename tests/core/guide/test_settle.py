"""Settling a guide: the root at its preferred height where that holds."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from rbprm_core.budget import Budget
from rbprm_core.errors import Cancelled
from rbprm_core.guide import GuidePath, Reachability, RootBounds, RootSpace, RrtOptions
from rbprm_core.guide.rrt import Edge
from rbprm_core.guide.settle import Settler
from rbprm_core.robot.data import RobotData
from rbprm_core.scene import Scene, make_surface

Array = NDArray[np.float64]
LEGS = ("lf_leg", "rf_leg", "lh_leg", "rh_leg")


def way(z: float, length: float = 3.0) -> GuidePath:
    return GuidePath(np.array([[0, 0, z, 0, 0, 0, 1], [length, 0, z, 0, 0, 0, 1.0]]))


class Ground:
    """Flat ground, and a lowest and highest z of the root."""

    def __init__(self, data: RobotData, low: float = 0.3, high: float = 1.0) -> None:
        ring = [[-2, -3, 0], [6, -3, 0], [6, 3, 0], [-2, 3, 0]]
        scene = Scene([make_surface("g", ring, 0.5)])
        box = np.array([[-3, 5], [-1, 1], [low, high]])
        space = RootSpace(RootBounds(box[:, 0], box[:, 1], np.ones(3)), np.zeros(0), np.zeros(0))
        self.edge = Edge(space, Reachability(data, scene, LEGS), RrtOptions())
        self.settler = Settler(data, scene, LEGS)

    def settle(self, path: GuidePath) -> GuidePath:
        return self.settler.settle(path, self.edge, Budget())


@pytest.mark.parametrize("z", [0.5, 0.7])
def test_the_root_rides_at_its_reference_height(hyq_data: RobotData, z: float) -> None:
    settled = Ground(hyq_data).settle(way(z))
    wanted = hyq_data.height + hyq_data.robot.limbs[0].radius
    middle = settled.at(settled.length / 2)
    assert middle[2] == pytest.approx(wanted, abs=5e-3)
    assert np.array_equal(settled.nodes[0], way(z).nodes[0])
    assert settled.nodes[-1] == pytest.approx(way(z).nodes[-1])


def test_what_is_settled_still_holds(hyq_data: RobotData) -> None:
    ground = Ground(hyq_data)
    settled = ground.settle(way(0.5))
    for a, b in zip(settled.nodes, settled.nodes[1:], strict=False):
        assert ground.edge.holds(a, b)


def test_bounds_are_kept(hyq_data: RobotData) -> None:
    settled = Ground(hyq_data, high=0.52).settle(way(0.5))
    assert settled.nodes[:, 2].max() <= 0.52 + 1e-6


def test_a_short_path_stays(hyq_data: RobotData) -> None:
    path = way(0.5, 0.1)
    assert Ground(hyq_data).settle(path) is path


def test_the_caller_may_stop_it(hyq_data: RobotData) -> None:
    ground = Ground(hyq_data)
    with pytest.raises(Cancelled):
        ground.settler.settle(way(0.5), ground.edge, Budget(cancelled=lambda: True))
