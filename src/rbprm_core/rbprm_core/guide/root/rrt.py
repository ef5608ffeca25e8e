"""Bidirectional RRT over the reachability condition (RB-RRT, section 3.3)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rbprm_core.budget import Budget
from rbprm_core.errors import NoGuideFound
from rbprm_core.guide.guide_options import RrtOptions
from rbprm_core.guide.root.edge import EdgeTest
from rbprm_core.guide.root.path import GuidePath
from rbprm_core.guide.root.search import GuideSearch, RootProblem
from rbprm_core.guide.root_space import StraightWay, distance

Array = NDArray[np.float64]


class Tree:
    """Nodes (n, 7 + j) with parents, in arrays that grow by doubling."""

    def __init__(self, root: Array) -> None:
        self._nodes = np.empty((64, len(root)))
        self._nodes[0] = root
        self._parents = [-1]

    def __len__(self) -> int:
        return len(self._parents)

    def __getitem__(self, index: int) -> Array:
        return np.asarray(self._nodes[index])

    def add(self, node: Array, parent: int) -> int:
        """Add a node; returns its index."""
        if len(self) == len(self._nodes):
            self._nodes = np.concatenate([self._nodes, np.empty_like(self._nodes)])
        self._nodes[len(self)] = node
        self._parents.append(parent)
        return len(self) - 1

    def nearest(self, node: Array) -> int:
        """Index of the nearest node."""
        return int(np.argmin(distance(self._nodes[: len(self)], node)))

    def branch(self, index: int) -> list[Array]:
        """Nodes from the tree's root to an index."""
        nodes = []
        while index >= 0:
            nodes.append(self[index].copy())
            index = self._parents[index]
        return nodes[::-1]


class RrtSearch(GuideSearch):
    """RRT-Connect (Kuffner and LaValle, 2000): grow one tree towards a sample, the other towards
    the new node, swap.

    The direct try takes the other end itself as the first sample: an open way costs one edge.
    """

    def __init__(self, problem: RootProblem, options: RrtOptions) -> None:
        self._problem, self._options = problem, options
        self._growth = Growth(problem.edges, options.step)

    def find(
        self, budget: Budget, rng: np.random.Generator, *, direct: bool = True
    ) -> tuple[GuidePath, int]:
        trees = (Tree(self._problem.start), Tree(self._problem.goal))
        iterations = self._options.iterations
        for i in range(iterations):
            budget.check("guide", i / iterations)
            growing, other = trees if i % 2 == 0 else trees[::-1]
            straight = direct and i < 2
            target = other[0] if straight else self._problem.sampler.draw(rng)
            met = None if target is None else self._extend(growing, other, target, straight)
            if met is not None:
                ends = met if i % 2 == 0 else met[::-1]
                there, back = trees[0].branch(ends[0]), trees[1].branch(ends[1])
                nodes = there + back[::-1][1:]
                return GuidePath(np.array(nodes)), len(trees[0]) + len(trees[1])
        reason = (
            f"{iterations} samples did not connect start and goal; "
            f"{len(trees[0])} nodes were reached from the start, {len(trees[1])} from the goal: "
            "widen the root bounds, require fewer limbs, or raise the iterations"
        )
        raise NoGuideFound(reason, len(trees[0]) + len(trees[1]))

    def _extend(
        self, growing: Tree, other: Tree, target: Array, greedy: bool
    ) -> tuple[int, int] | None:
        """Grow one tree towards a target and the other towards it; where they meet, or None."""
        reached = self._growth.grow(growing, target, greedy)
        if reached is None:
            return None
        met = self._growth.grow(other, growing[reached], greedy=True)
        if met is None or not np.array_equal(other[met], growing[reached]):
            return None
        return reached, met


class Growth:
    """Growing a tree along a straight edge as far as bounds and reachability hold."""

    def __init__(self, edges: EdgeTest, step: float) -> None:
        self._edges, self._step = edges, step

    def grow(self, tree: Tree, target: Array, greedy: bool) -> int | None:
        """Grow towards a target by one step, or (greedy) until it is reached or blocked.

        Returns:
            Index of the last node added, None where the first step is blocked.
        """
        last = tree.nearest(target)
        added = None
        while True:
            way = StraightWay(tree[last], target)
            if way.length == 0:
                return last
            share = min(1.0, self._step / way.length)
            node = target.copy() if share == 1 else way.at(share)
            if not self._edges.holds(tree[last], node):
                return added
            added = last = tree.add(node, last)
            if share == 1 or not greedy:
                return added
