"""Visibility PRM under the reachability condition (RB-PRM; Park et al. 2016, section II-A)."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from rbprm_core.arrays import Array
from rbprm_core.budget import Budget
from rbprm_core.errors import NoGuideFound
from rbprm_core.failures import Cause, Failure
from rbprm_core.guide.guide_options import PrmOptions
from rbprm_core.guide.roadmap import Roadmap
from rbprm_core.guide.root.path import GuidePath
from rbprm_core.guide.root.search import RootProblem, RootSearch
from rbprm_core.guide.root_space import RootSegment, distance
from rbprm_core.stages import Stage

DETOUR_SAMPLES = 10  # samples tried for a detour
DETOUR_FACTOR = 3.0  # maximum random factor on an edge's cost, when a different path is needed


class PrmSearch(RootSearch):
    """Visibility PRM (Siméon et al. 2000) between start and goal.

    A sample from which no node of the roadmap is visible becomes a guard. A sample from which
    several connected components are visible joins them as a connector. Any other sample is
    redundant. Sampling ends when start and goal are connected.

    Start and goal are samples themselves; where they are redundant, they are kept for this request
    only. What the roadmap holds from earlier requests is tested again only where the scene has
    changed near it, and only when a path uses it.

    Args:
        problem: start, goal and the tests of what lies between them.
        roadmap: roadmap opened for the problem's scene. If it is not empty, paths depend on its
            history, and not on request and seed alone.
        options: number of neighbours and of iterations.
    """

    def __init__(self, problem: RootProblem, roadmap: Roadmap, options: PrmOptions) -> None:
        self._problem, self._edges = problem, problem.edges
        self._roadmap, self._options = roadmap, options
        self._ends: tuple[int, int] | None = None
        self._excluded: set[tuple[int, int]] = set()  # edges that pass an avoided root

    def find(
        self, budget: Budget, rng: np.random.Generator, *, direct: bool = True
    ) -> tuple[GuidePath, int]:
        """See `RootSearch.find`; the number of nodes is that of the roadmap.

        Args:
            budget: time limit and cancel flag, checked at every iteration.
            rng: source of random numbers.
            direct: True to try the straight segment first.
        """
        start, goal = self._problem.start, self._problem.goal
        if direct and self._edges.holds(start, goal):
            return GuidePath(np.array([start, goal])), 2
        if self._ends is None:
            self._ends = self._attach(start), self._attach(goal)
        factor = 1.0 if direct else DETOUR_FACTOR
        if not direct:
            self._add_detour(rng)
        iterations = self._options.iterations
        changed = True
        for i in range(iterations):
            budget.check(Stage.GUIDE, i / iterations)
            path = self._cheapest_path(*self._ends, budget, rng, factor) if changed else None
            if path is not None:
                return path, len(self._roadmap)
            self._ends = self._reattached(self._ends)
            sample = self._problem.sampler.draw(rng)
            changed = sample is not None and self._add_if_useful(sample)
        failure = Failure.of(
            Cause.ROADMAP_NOT_CONNECTED,
            samples=iterations,
            nodes=len(self._roadmap),
            parts=len(set(self._roadmap.components().values())),
        )
        raise NoGuideFound(failure, len(self._roadmap))

    def _cheapest_path(
        self, start: int, goal: int, budget: Budget, rng: np.random.Generator, factor: float
    ) -> GuidePath | None:
        """Cheapest path over valid edges, after testing unverified ones; None where none exists.

        Args:
            start: number of the start's node.
            goal: number of the goal's node.
            budget: checked before each search, in stage "guide".
            rng: source of random numbers.
            factor: maximum random factor on the costs of edges, for a path that is not the
                shortest; 1 for none.
        """
        roadmap, costs = self._roadmap, dict[tuple[int, int], float]()

        def cost(i: int, j: int) -> float:
            if (i, j) in self._excluded:
                return np.inf
            if (i, j) not in costs:
                length = RootSegment(roadmap.nodes[i].root, roadmap.nodes[j].root).length
                costs[i, j] = max(length, 1e-9) * (rng.uniform(1.0, factor) if factor > 1 else 1.0)
            return costs[i, j]

        while start in roadmap.nodes and goal in roadmap.nodes:
            budget.check(Stage.GUIDE)
            numbers = roadmap.shortest(start, goal, cost)
            if numbers is None:
                return None
            if all(self._usable(i, j) for i, j in pairwise(numbers)):
                return GuidePath(np.array([roadmap.nodes[i].root for i in numbers]))
        return None

    def _usable(self, i: int, j: int) -> bool:
        """True where a path may use an edge; one that it may not use is excluded or removed."""
        roadmap, nodes = self._roadmap, self._roadmap.nodes
        if i not in nodes or j not in nodes:
            return False
        a, b = nodes[i].root, nodes[j].root
        if self._edges.avoids(a, b):
            self._excluded.add((min(i, j), max(i, j)))
            return False
        if not roadmap.unverified(i, j):
            return True
        if nodes[i].unverified and not self._edges.reachability.holds(a):
            roadmap.remove_node(i)
            return False
        if not self._edges.holds(a, b):
            roadmap.remove_edge(i, j)
            return False
        roadmap.confirm(i, j)
        return True

    def _attach(self, root: Array) -> int:
        """Number of the node at start or goal, connected to all visible nodes nearby."""
        for number, node in self._roadmap.nodes.items():
            if np.array_equal(node.root, root):
                return number
        visible = [number for numbers in self._visible(root, every=True) for number in numbers]
        components = self._roadmap.components()
        redundant = len({components[number] for number in visible}) == 1
        return self._roadmap.add(root, visible, temporary=redundant)

    def _reattached(self, ends: tuple[int, int]) -> tuple[int, int]:
        """Numbers of start and goal, attached again where a test has removed them."""
        roots = (self._problem.start, self._problem.goal)
        first, last = (
            number if number in self._roadmap.nodes else self._attach(root)
            for number, root in zip(ends, roots, strict=True)
        )
        return first, last

    def _add_if_useful(self, sample: Array) -> bool:
        """Add a sample that is a guard or a connector; True where it is one."""
        visible = [numbers[0] for numbers in self._visible(sample, every=False)]
        if len(visible) != 1:
            self._roadmap.add(sample, visible)
        return len(visible) != 1

    def _add_detour(self, rng: np.random.Generator) -> None:
        """Add a sample with two or more visible nodes, redundant or not, for a different path."""
        for _ in range(DETOUR_SAMPLES):
            sample = self._problem.sampler.draw(rng)
            if sample is None:
                continue
            visible = [n for numbers in self._visible(sample, every=True) for n in numbers]
            if len(visible) > 1:
                self._roadmap.add(sample, visible)
                return

    def _visible(self, root: Array, every: bool) -> list[list[int]]:
        """Numbers of visible nodes (valid edge from the root), one list a connected component.

        Only the nearest few nodes of each component are tested. An edge between start and goal is
        not: `find` has tested it.

        Args:
            root: (7 + j,) root configuration.
            every: True for all visible nodes, False for the nearest one of each component.
        """
        nodes, components = self._roadmap.nodes, self._roadmap.components(self._excluded)
        if not nodes:
            return []
        ends = (self._problem.start, self._problem.goal)
        is_end = any(root is end for end in ends)
        numbers = np.array(list(nodes))
        distances = distance(np.array([node.root for node in nodes.values()]), root)
        tested: dict[int, int] = {}
        visible: dict[int, list[int]] = {}
        for number in numbers[np.argsort(distances, kind="stable")].tolist():
            component = components[number]
            other = nodes[number].root
            if is_end and any(np.array_equal(other, end) for end in ends):
                continue
            enough = tested.get(component, 0) >= self._options.neighbours
            if enough or (component in visible and not every):
                continue
            tested[component] = tested.get(component, 0) + 1
            if self._edges.holds(root, other):
                visible.setdefault(component, []).append(number)
        return list(visible.values())
