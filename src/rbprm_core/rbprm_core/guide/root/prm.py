"""Visibility-PRM over the reachability condition (RB-PRM, paper 004, section II-A)."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from rbprm_core.budget import Budget
from rbprm_core.errors import NoGuideFound
from rbprm_core.guide.guide_options import PrmOptions
from rbprm_core.guide.roadmap import Roadmap
from rbprm_core.guide.root.path import GuidePath
from rbprm_core.guide.root.search import GuideSearch, RootProblem
from rbprm_core.guide.root_space import StraightWay, distance

Array = NDArray[np.float64]

DETOURS = 10  # samples tried for a detour
DETOUR = 3.0  # factor by which a random price may lengthen an edge where another way is asked for


class PrmSearch(GuideSearch):
    """Visibility-PRM (Simeon, Laumond and Nissoux, 2000) between start and goal.

    A sample that sees no node of the roadmap becomes a guard, one that sees several of its parts
    joins them as a connector, any other is redundant. Sampling ends when start and goal are
    connected. Start and goal are samples themselves, kept for this request alone where the rule
    calls them redundant. What the roadmap holds from earlier requests is tested again only where
    the scene changed near it, and only once a way leads over it.

    Args:
        roadmap: opened for the problem's scene. Where it holds something already, the guides
            depend on its history, no longer on request and seed alone.
    """

    def __init__(self, problem: RootProblem, roadmap: Roadmap, options: PrmOptions) -> None:
        self._problem, self._edges = problem, problem.edges
        self._roadmap, self._options = roadmap, options
        self._ends: tuple[int, int] | None = None
        self._shunned: set[tuple[int, int]] = set()  # edges past a root that is to be avoided

    def find(
        self, budget: Budget, rng: np.random.Generator, *, direct: bool = True
    ) -> tuple[GuidePath, int]:
        start, goal = self._problem.start, self._problem.goal
        if direct and self._edges.holds(start, goal):
            return GuidePath(np.array([start, goal])), 2
        if self._ends is None:
            self._ends = self._attach(start), self._attach(goal)
        price = 1.0 if direct else DETOUR
        if not direct:
            self._add_detour(rng)
        iterations = self._options.iterations
        changed = True
        for i in range(iterations):
            budget.check("guide", i / iterations)
            path = self._way(*self._ends, budget, rng, price) if changed else None
            if path is not None:
                return path, len(self._roadmap)
            self._ends = self._restored(self._ends)
            sample = self._problem.sampler.draw(rng)
            changed = sample is not None and self._offer(sample)
        reason = (
            f"{iterations} samples did not connect start and goal; the roadmap has "
            f"{len(self._roadmap)} nodes in {len(set(self._roadmap.parts().values()))} parts: "
            "widen the root bounds, require fewer limbs, or raise the iterations"
        )
        raise NoGuideFound(reason, len(self._roadmap))

    def _way(
        self, start: int, goal: int, budget: Budget, rng: np.random.Generator, price: float
    ) -> GuidePath | None:
        """The cheapest way over edges that hold, testing those in doubt; None where there is none.

        Args:
            price: up to which edges are made dearer at random, for another way than the cheapest.
        """
        roadmap, prices = self._roadmap, {}

        def cost(i: int, j: int) -> float:
            if (i, j) in self._shunned:
                return np.inf
            if (i, j) not in prices:
                span = StraightWay(roadmap.nodes[i].root, roadmap.nodes[j].root).length
                prices[i, j] = max(span, 1e-9) * (rng.uniform(1.0, price) if price > 1 else 1.0)
            return prices[i, j]

        while start in roadmap.nodes and goal in roadmap.nodes:
            budget.check("guide")
            way = roadmap.shortest(start, goal, cost)
            if way is None:
                return None
            if all(self._passable(i, j) for i, j in pairwise(way)):
                return GuidePath(np.array([roadmap.nodes[i].root for i in way]))
        return None

    def _passable(self, i: int, j: int) -> bool:
        """True where an edge may be taken; one that may not is shunned or dropped."""
        roadmap, nodes = self._roadmap, self._roadmap.nodes
        if i not in nodes or j not in nodes:
            return False
        a, b = nodes[i].root, nodes[j].root
        if self._edges.avoids(a, b):
            self._shunned.add((min(i, j), max(i, j)))
            return False
        if not roadmap.doubtful(i, j):
            return True
        if nodes[i].doubtful and not self._edges.reachability.holds(a):
            roadmap.drop_node(i)
            return False
        if not self._edges.holds(a, b):
            roadmap.drop_edge(i, j)
            return False
        roadmap.confirm(i, j)
        return True

    def _attach(self, root: Array) -> int:
        """Number of the node at start or goal, with edges to what it sees."""
        for number, node in self._roadmap.nodes.items():
            if np.array_equal(node.root, root):
                return number
        seen = [number for numbers in self._seen(root, every=True) for number in numbers]
        parts = self._roadmap.parts()
        passing = len({parts[number] for number in seen}) == 1
        return self._roadmap.add(root, seen, passing)

    def _restored(self, ends: tuple[int, int]) -> tuple[int, int]:
        """Start and goal, attached anew where a test in doubt dropped them."""
        roots = (self._problem.start, self._problem.goal)
        first, last = (
            number if number in self._roadmap.nodes else self._attach(root)
            for number, root in zip(ends, roots, strict=True)
        )
        return first, last

    def _offer(self, sample: Array) -> bool:
        """Add a sample that is a guard or a connector; True where it was."""
        seen = [numbers[0] for numbers in self._seen(sample, every=False)]
        if len(seen) != 1:
            self._roadmap.add(sample, seen)
        return len(seen) != 1

    def _add_detour(self, rng: np.random.Generator) -> None:
        """Add a sample that sees two nodes at least, redundant or not: another way."""
        for _ in range(DETOURS):
            sample = self._problem.sampler.draw(rng)
            if sample is None:
                continue
            seen = [number for numbers in self._seen(sample, every=True) for number in numbers]
            if len(seen) > 1:
                self._roadmap.add(sample, seen)
                return

    def _seen(self, root: Array, every: bool) -> list[list[int]]:
        """Of each part in sight, the nearest node that a root sees, or (every) all such nodes.

        Only the nearest few nodes of each part are looked at. Start and goal are left to `find`:
        an edge between them would be the straight way once more.
        """
        nodes, parts = self._roadmap.nodes, self._roadmap.parts(self._shunned)
        if not nodes:
            return []
        ends = (self._problem.start, self._problem.goal)
        is_end = any(root is end for end in ends)
        numbers = np.array(list(nodes))
        spans = distance(np.array([node.root for node in nodes.values()]), root)
        looked: dict[int, int] = {}
        seen: dict[int, list[int]] = {}
        for number in numbers[np.argsort(spans, kind="stable")].tolist():
            part = parts[number]
            other = nodes[number].root
            if is_end and any(np.array_equal(other, end) for end in ends):
                continue
            enough = looked.get(part, 0) >= self._options.neighbours
            if enough or (part in seen and not every):
                continue
            looked[part] = looked.get(part, 0) + 1
            if self._edges.holds(root, other):
                seen.setdefault(part, []).append(number)
        return list(seen.values())
