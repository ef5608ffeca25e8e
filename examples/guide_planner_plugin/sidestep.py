"""An example of a guide planner: straight to the goal, or past two via points at the side."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from rbprm_core.budget import Budget
from rbprm_core.errors import NoGuideFound
from rbprm_core.failures import Cause, Failure
from rbprm_core.guide.protocol import GuidePlanner, GuideProblem
from rbprm_core.guide.root import GuidePath, RootGuidePlanner, RootProblem, RootSearch
from rbprm_core.guide.root_space import RootSegment
from rbprm_core.stages import Stage

OFFSETS = (0.25, -0.25, 0.5, -0.5, 1.0, -1.0, 1.5, -1.5, 2.0, -2.0)  # m, to the left


def sidestep(problem: GuideProblem) -> GuidePlanner:
    """The guide planner at work on a problem.

    `RootGuidePlanner` adds what every planner of root paths needs: the tests of start and goal,
    root configurations to avoid, shortcuts and settling.

    Args:
        problem: robot, scene, start, goal and options.
    """
    return RootGuidePlanner(problem, SidestepSearch)


class SidestepSearch(RootSearch):
    """Search for the first valid path in a fixed order: straight, then with larger detours.

    Args:
        problem: start, goal and the tests of what lies between them.
    """

    def __init__(self, problem: RootProblem) -> None:
        self._start, self._goal, self._edges = problem.start, problem.goal, problem.edges

    def find(
        self, budget: Budget, rng: np.random.Generator, *, direct: bool = True
    ) -> tuple[GuidePath, int]:
        """See `RootSearch.find`; the path depends on no random number."""
        if direct and self._edges.holds(self._start, self._goal):
            return GuidePath(np.array([self._start, self._goal])), 2
        along = self._goal[:2] - self._start[:2]
        left = np.array([-along[1], along[0]]) / max(float(np.linalg.norm(along)), 1e-9)
        quarters = RootSegment(self._start, self._goal).at_all(np.array([0.25, 0.75]))
        for tried, offset in enumerate(OFFSETS):
            budget.check(Stage.GUIDE, tried / len(OFFSETS))
            nodes = np.array([self._start, *quarters, self._goal])
            nodes[1:-1, :2] += offset * left
            if all(self._edges.holds(a, b) for a, b in pairwise(nodes)):
                return GuidePath(nodes), len(nodes)
        raise NoGuideFound(Failure.of(Cause.NO_VALID_PATH, tried=len(OFFSETS)))
