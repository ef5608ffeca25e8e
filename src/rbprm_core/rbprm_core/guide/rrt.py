"""Bidirectional RRT over the reachability condition (RB-RRT, section 3.3)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from rbprm_core.budget import Budget
from rbprm_core.errors import NoGuideFound
from rbprm_core.guide.path import GuidePath
from rbprm_core.guide.reachability import Reachability
from rbprm_core.guide.sampler import RootSampler
from rbprm_core.guide.space import RootSpace, distance, interpolate

Array = NDArray[np.float64]


Positive = Annotated[float, Field(gt=0)]


@dataclass(frozen=True)
class RrtOptions:
    """Options of the guide search.

    Attributes:
        step: most metres that a tree grows at once.
        resolution: metres between the points of an edge at which the condition is tested.
        iterations: samples drawn before the search is given up.
    """

    step: Positive = 0.4
    resolution: Positive = 0.05
    iterations: Annotated[int, Field(ge=2)] = 2_000


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


def plan_rrt(
    start: Array,
    goal: Array,
    space: RootSpace,
    reachability: Reachability,
    sampler: RootSampler,
    budget: Budget,
    rng: np.random.Generator,
    options: RrtOptions = RrtOptions(),
    *,
    direct: bool = True,
) -> tuple[GuidePath, int]:
    """A path of reachable roots from start to goal, and the number of nodes it took.

    RRT-Connect (Kuffner and LaValle, 2000): grow one tree towards a sample, the other towards the
    new node, swap.

    Args:
        direct: take the other end itself as the first sample, so that an open way costs one edge.

    Raises:
        NoGuideFound: all iterations used. TimeLimitReached, Cancelled: from the budget.
    """
    trees = (Tree(start), Tree(goal))
    edge = Edge(space, reachability, options)
    for i in range(options.iterations):
        budget.check("guide", i / options.iterations)
        growing, other = trees if i % 2 == 0 else trees[::-1]
        straight = direct and i < 2
        target = other[0] if straight else sampler.draw(rng)
        if target is None:
            continue
        reached = edge.grow(growing, target, greedy=straight)
        if reached is None:
            continue
        met = edge.grow(other, growing[reached], greedy=True)
        if met is not None and np.array_equal(other[met], growing[reached]):
            ends = (reached, met) if i % 2 == 0 else (met, reached)
            there, back = trees[0].branch(ends[0]), trees[1].branch(ends[1])
            nodes = there + back[::-1][1:]
            return GuidePath(np.array(nodes)), len(trees[0]) + len(trees[1])
    reason = (
        f"{options.iterations} samples did not connect start and goal; "
        f"{len(trees[0])} nodes were reached from the start, {len(trees[1])} from the goal: "
        "widen the root bounds, require fewer limbs, or raise the iterations"
    )
    raise NoGuideFound(reason, len(trees[0]) + len(trees[1]))


class Edge:
    """Growing a tree along a straight edge as far as bounds and reachability hold."""

    def __init__(self, space: RootSpace, reachability: Reachability, options: RrtOptions) -> None:
        self._space, self._reachability, self._options = space, reachability, options

    def grow(self, tree: Tree, target: Array, greedy: bool) -> int | None:
        """Grow towards a target by one step, or (greedy) until it is reached or blocked.

        Returns:
            Index of the last node added, None where the first step is blocked.
        """
        last = tree.nearest(target)
        added = None
        while True:
            span = float(distance(tree[last], target))
            if span == 0:
                return last
            share = min(1.0, self._options.step / span)
            node = target.copy() if share == 1 else interpolate(tree[last], target, share)
            if not self.holds(tree[last], node):
                return added
            added = last = tree.add(node, last)
            if share == 1 or not greedy:
                return added

    def holds(self, a: Array, b: Array) -> bool:
        """True where bounds and reachability hold from a (known to hold) to b."""
        steps = max(1, int(np.ceil(float(distance(a, b)) / self._options.resolution)))
        inside = all(
            self._space.contains(interpolate(a, b, i / steps)) for i in range(1, steps + 1)
        )
        return inside and self._reachability.edge_holds(a, b, steps)
