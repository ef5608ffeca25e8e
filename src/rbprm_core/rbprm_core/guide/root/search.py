"""Interface of the searches for root paths, which `RootGuidePlanner` shortens and settles."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from rbprm_core.arrays import Array
from rbprm_core.budget import Budget
from rbprm_core.guide.root.edge import EdgeTest
from rbprm_core.guide.root.path import GuidePath
from rbprm_core.guide.root.sampler import RootSampler


@dataclass(frozen=True, eq=False)
class RootProblem:
    """Input of a search: start, goal, and the tests of what lies between them.

    Attributes:
        start: (7 + j,) root configuration, known to be valid.
        goal: (7 + j,) root configuration, known to be valid.
        edges: test of edges.
        sampler: sampler of valid root configurations.
    """

    start: Array
    goal: Array
    edges: EdgeTest
    sampler: RootSampler


class RootSearch(ABC):
    """Search at work on one problem; used again where no contact sequence follows its path."""

    @abstractmethod
    def find(
        self, budget: Budget, rng: np.random.Generator, *, direct: bool = True
    ) -> tuple[GuidePath, int]:
        """Path from start to goal whose edges are valid, and the number of nodes of the search.

        Args:
            budget: checked at every iteration, in stage "guide".
            rng: source of random numbers.
            direct: True to try the straight segment first. False after a path has failed, to get
                a different one.

        Raises:
            NoGuideFound: all iterations are used up.
            TimeLimitReached: raised by the budget.
            Cancelled: raised by the budget.
        """
