"""The guide planners for root paths, RB-RRT and RB-PRM, as `rbprm_core.guide.protocol` asks for.

Tonneau et al. 2018, section 3: the root moves under the reachability condition. The paths found
are shortened and settled here.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from rbprm_core.arrays import Array
from rbprm_core.budget import Budget
from rbprm_core.failures import Failure
from rbprm_core.guide.protocol import GuideProblem, GuideResult
from rbprm_core.guide.roadmap import Roadmap, roadmap_key
from rbprm_core.guide.root.edge import EdgeTest
from rbprm_core.guide.root.path import GuidePath
from rbprm_core.guide.root.prm import PrmSearch
from rbprm_core.guide.root.reachability import Reachability
from rbprm_core.guide.root.root_equilibrium import EquilibriumTest
from rbprm_core.guide.root.rrt import RrtSearch
from rbprm_core.guide.root.sampler import RootSampler, effector_places
from rbprm_core.guide.root.search import RootProblem, RootSearch
from rbprm_core.guide.root.settle import Settler
from rbprm_core.guide.root.shortcut import shorten
from rbprm_core.stages import Stage


class RootGuidePlanner:
    """Guide planner that searches a path of the root, shortens it and settles it.

    Args:
        problem: problem to work on.
        make_search: makes the search for paths from start, goal and the tests of roots and edges.
    """

    def __init__(
        self, problem: GuideProblem, make_search: Callable[[RootProblem], RootSearch]
    ) -> None:
        self._problem = problem
        data, scene, options = problem.data, problem.scene, problem.options
        equilibrium = None
        if options.equilibrium:
            equilibrium = EquilibriumTest(data, scene, problem.required_limbs, problem.gravity)
        self._condition = Reachability(
            data, scene, problem.required_limbs, equilibrium, problem.budget
        )
        self._edges = EdgeTest(problem.space, self._condition, options.resolution)
        joints = data.robot.reference[data.robot.root_index[7:]]
        reach = None if problem.gravity.any() else effector_places(data)
        sampler = RootSampler(problem.space, scene, self._condition, data.height, joints, reach)
        root_problem = RootProblem(problem.start, problem.goal, self._edges, sampler)
        self._search = make_search(root_problem)
        problem.budget.poll()
        self._settler = Settler(data, scene, problem.required_limbs)

    def find(self, budget: Budget, rng: np.random.Generator, *, direct: bool = True) -> GuideResult:
        """See `GuidePlanner.find`.

        Args:
            budget: time limit and cancel flag, checked at every iteration.
            rng: source of random numbers.
            direct: True to try the straight segment first.
        """
        path, nodes = self._search.find(budget, rng, direct=direct)
        with self._problem.counters.timed(Stage.SHORTCUT):
            return GuideResult(self._finished(path, budget, rng), nodes)

    def avoid(self, root: Array, keep: tuple[Array, ...]) -> None:
        """See `GuidePlanner.avoid`.

        Args:
            root: (7 + j,) root configuration to avoid.
            keep: root configurations (7 + j,) that stay valid.
        """
        self._condition.avoid(root, keep)

    def forget(self) -> None:
        """See `GuidePlanner.forget`."""
        self._condition.forget()

    def failure(self, root: Array) -> Failure | None:
        """See `GuidePlanner.failure`.

        Args:
            root: (7 + j,) root configuration.
        """
        return self._condition.failure(root)

    def trunk_failure(self, root: Array) -> Failure | None:
        """See `GuidePlanner.trunk_failure`.

        Args:
            root: (7 + j,) root configuration.
        """
        return self._condition.trunk_failure(root)

    def _finished(self, path: GuidePath, budget: Budget, rng: np.random.Generator) -> GuidePath:
        """The path with random shortcuts, then settled."""
        options = self._problem.options
        path = shorten(path, self._edges, options.shortcuts, budget, rng)
        if options.settle and self._problem.gravity.any():
            path = self._settler.settle(path, self._edges, budget)
        return path


def rrt_planner(problem: GuideProblem) -> RootGuidePlanner:
    """The bidirectional RRT at work on a problem.

    Args:
        problem: problem to work on.
    """
    return RootGuidePlanner(problem, lambda roots: RrtSearch(roots, problem.options.rrt))


def prm_planner(problem: GuideProblem) -> RootGuidePlanner:
    """The visibility PRM at work on a problem, on a kept roadmap where the problem has a store.

    Args:
        problem: problem to work on.
    """

    def search(roots: RootProblem) -> RootSearch:
        return PrmSearch(roots, _roadmap(problem, roots), problem.options.prm)

    return RootGuidePlanner(problem, search)


def _roadmap(problem: GuideProblem, roots: RootProblem) -> Roadmap:
    """The kept roadmap of the problem, opened for its scene; a new one without a store."""
    if problem.roadmaps is None:
        return Roadmap()
    key = roadmap_key(
        problem.data, problem.space, problem.required_limbs, problem.options, problem.gravity
    )
    return problem.roadmaps.roadmap(key, problem.scene, roots.edges.reachability.radius)
