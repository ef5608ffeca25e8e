"""Bidirectional RRT under the reachability condition (RB-RRT; Tonneau et al. 2018, section 3.3)."""

from __future__ import annotations

import numpy as np

from rbprm_core.arrays import Array
from rbprm_core.budget import Budget
from rbprm_core.errors import NoGuideFound
from rbprm_core.failures import Cause, Failure
from rbprm_core.guide.guide_options import RrtOptions
from rbprm_core.guide.root.edge import EdgeTest
from rbprm_core.guide.root.path import GuidePath
from rbprm_core.guide.root.search import RootProblem, RootSearch
from rbprm_core.guide.root_space import RootSegment, distance
from rbprm_core.stages import Stage


class Tree:
    """Tree of root configurations, in an array that grows by doubling.

    Args:
        root: (7 + j,) root configuration at the tree's first node.
    """

    def __init__(self, root: Array) -> None:
        self._nodes = np.empty((64, len(root)))
        self._nodes[0] = root
        self._parents = [-1]

    def __len__(self) -> int:
        return len(self._parents)

    def __getitem__(self, index: int) -> Array:
        return np.asarray(self._nodes[index])

    def add(self, node: Array, parent: int) -> int:
        """Add a node; returns its index.

        Args:
            node: (7 + j,) root configuration.
            parent: index of its parent.
        """
        if len(self) == len(self._nodes):
            self._nodes = np.concatenate([self._nodes, np.empty_like(self._nodes)])
        self._nodes[len(self)] = node
        self._parents.append(parent)
        return len(self) - 1

    def nearest(self, node: Array) -> int:
        """Index of the node nearest to a root configuration.

        Args:
            node: (7 + j,) root configuration.
        """
        return int(np.argmin(distance(self._nodes[: len(self)], node)))

    def branch(self, index: int) -> list[Array]:
        """Root configurations (7 + j,) from the tree's first node to another node.

        Args:
            index: index of the last node.
        """
        nodes = []
        while index >= 0:
            nodes.append(self[index].copy())
            index = self._parents[index]
        return nodes[::-1]


class RrtSearch(RootSearch):
    """RRT-Connect (Kuffner and LaValle 2000).

    One tree is extended towards a sample and the other is then connected to the new node; the two
    trees take turns. A direct search takes the other tree's first node as the first sample, so that
    a straight path costs one edge.

    Args:
        problem: start, goal and the tests of what lies between them.
        options: length of edges and number of iterations.
    """

    def __init__(self, problem: RootProblem, options: RrtOptions) -> None:
        self._problem, self._options = problem, options
        self._extension = TreeExtension(problem.edges, options.step)

    def find(
        self, budget: Budget, rng: np.random.Generator, *, direct: bool = True
    ) -> tuple[GuidePath, int]:
        """See `RootSearch.find`; the number of nodes is that of both trees.

        Args:
            budget: time limit and cancel flag, checked at every iteration.
            rng: source of random numbers.
            direct: True to try the straight segment first.
        """
        trees = (Tree(self._problem.start), Tree(self._problem.goal))
        iterations = self._options.iterations
        for i in range(iterations):
            budget.check(Stage.GUIDE, i / iterations)
            growing, other = trees if i % 2 == 0 else trees[::-1]
            straight = direct and i < 2
            target = other[0] if straight else self._problem.sampler.draw(rng)
            met = None if target is None else self._connect(growing, other, target, straight)
            if met is not None:
                ends = met if i % 2 == 0 else met[::-1]
                there, back = trees[0].branch(ends[0]), trees[1].branch(ends[1])
                nodes = there + back[::-1][1:]
                return GuidePath(np.array(nodes)), len(trees[0]) + len(trees[1])
        failure = Failure.of(
            Cause.TREES_NOT_CONNECTED,
            samples=iterations,
            start_nodes=len(trees[0]),
            goal_nodes=len(trees[1]),
        )
        raise NoGuideFound(failure, len(trees[0]) + len(trees[1]))

    def _connect(
        self, growing: Tree, other: Tree, target: Array, greedy: bool
    ) -> tuple[int, int] | None:
        """Extend one tree towards a target and the other towards the new node.

        Args:
            growing: tree that is extended towards the target.
            other: tree that is then extended towards the new node until it is blocked.
            target: (7 + j,) root configuration.
            greedy: see `TreeExtension.extend`, for the first tree.

        Returns:
            Index of the common node in both trees; None where they do not meet.
        """
        reached = self._extension.extend(growing, target, greedy)
        if reached is None:
            return None
        met = self._extension.extend(other, growing[reached], greedy=True)
        if met is None or not np.array_equal(other[met], growing[reached]):
            return None
        return reached, met


class TreeExtension:
    """Extension of a tree along a straight segment as far as its edges are valid.

    Args:
        edges: test of edges.
        step: maximum length of an edge, m.
    """

    def __init__(self, edges: EdgeTest, step: float) -> None:
        self._edges, self._step = edges, step

    def extend(self, tree: Tree, target: Array, greedy: bool) -> int | None:
        """Extend a tree from its nearest node towards a target.

        Args:
            tree: tree that is extended.
            target: (7 + j,) root configuration.
            greedy: True to continue until the target is reached or an edge is invalid (CONNECT);
                False for a single edge (EXTEND).

        Returns:
            Index of the last node added; None where the first edge is invalid.
        """
        last = tree.nearest(target)
        added = None
        while True:
            segment = RootSegment(tree[last], target)
            if segment.length == 0:
                return last
            share = min(1.0, self._step / segment.length)
            node = target.copy() if share == 1 else segment.at(share)
            if not self._edges.holds(tree[last], node):
                return added
            added = last = tree.add(node, last)
            if share == 1 or not greedy:
                return added
