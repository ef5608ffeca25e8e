"""What every guide planner is asked, and how it answers."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rbprm_core.budget import Budget
from rbprm_core.guide.root.edge import EdgeTest
from rbprm_core.guide.root.path import GuidePath
from rbprm_core.guide.root.sampler import RootSampler

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class RootProblem:
    """Start and goal, and what decides about the ways between them.

    Attributes:
        start, goal: (7 + j,) root configurations, known to hold.
        edges: the test of an edge. sampler: of roots that hold.
    """

    start: Array
    goal: Array
    edges: EdgeTest
    sampler: RootSampler


class GuideSearch(ABC):
    """A guide planner at work on one problem; asked again where its guides led nowhere."""

    @abstractmethod
    def find(
        self, budget: Budget, rng: np.random.Generator, *, direct: bool = True
    ) -> tuple[GuidePath, int]:
        """A path from start to goal whose edges hold, and the number of nodes it took.

        Args:
            direct: try the straight way first; a guide that failed on it asks for another way.

        Raises:
            NoGuideFound: all iterations used. TimeLimitReached, Cancelled: from the budget.
        """
