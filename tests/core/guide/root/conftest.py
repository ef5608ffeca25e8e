"""Shared by the tests of root guides: a robot in a scene, and the tests of its root."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest

from rbprm_core.arrays import Array
from rbprm_core.guide.root import (
    EdgeTest,
    GuideOptions,
    Reachability,
    RootBounds,
    RootProblem,
    RootSampler,
    RootSpace,
    Settler,
)
from rbprm_core.robot.data import RobotData
from rbprm_core.scene import Scene

LEGS = ("lf_leg", "rf_leg", "lh_leg", "rh_leg")


@dataclass
class Ground:
    """HyQ in a scene."""

    data: RobotData
    scene: Scene
    bounds: RootBounds

    def __post_init__(self) -> None:
        self.space = RootSpace(self.bounds, np.zeros(0), np.zeros(0))
        self.condition = Reachability(self.data, self.scene, LEGS)
        self.edges = EdgeTest(self.space, self.condition, GuideOptions().resolution)
        self.sampler = RootSampler(
            self.space, self.scene, self.condition, self.data.height, np.zeros(0)
        )
        self.settler = Settler(self.data, self.scene, LEGS)

    def problem(self, start: Array, goal: Array) -> RootProblem:
        """Problem from start to goal."""
        return RootProblem(start, goal, self.edges, self.sampler)


@pytest.fixture(scope="session")
def make_ground(hyq_data: RobotData) -> Callable[[Scene, RootBounds], Ground]:
    """Makes HyQ in a scene with root bounds: `make_ground(scene, bounds)`."""
    return lambda scene, bounds: Ground(hyq_data, scene, bounds)
