"""Random shortcuts: replace parts of a path by straight edges that are valid."""

from __future__ import annotations

import numpy as np

from rbprm_core.budget import Budget
from rbprm_core.guide.root.edge import EdgeTest
from rbprm_core.guide.root.path import GuidePath
from rbprm_core.guide.root_space import RootSegment
from rbprm_core.stages import Stage

MIN_GAIN = 0.01  # share of the replaced part; a smaller gain is not worth the test of an edge


def shorten(
    path: GuidePath, edges: EdgeTest, loops: int, budget: Budget, rng: np.random.Generator
) -> GuidePath:
    """Path with random shortcuts between two of its points.

    Args:
        path: path to shorten.
        edges: test of edges.
        loops: number of shortcuts tried.
        budget: checked before each try, in stage "shortcut".
        rng: source of random numbers.

    Raises:
        TimeLimitReached: raised by the budget.
        Cancelled: raised by the budget.
    """
    for i in range(loops):
        budget.check(Stage.SHORTCUT, i / loops)
        if len(path.nodes) == 2:
            break
        first, second = np.sort(rng.uniform(0, path.length, 2))
        a, b = path.root(first), path.root(second)
        # Between two points of one edge there is nothing to gain.
        if RootSegment(a, b).length < (1 - MIN_GAIN) * (second - first) and edges.holds(a, b):
            before, after = path.arc_lengths <= first, path.arc_lengths >= second
            path = GuidePath(np.concatenate([path.nodes[before], [a, b], path.nodes[after]]))
    return path
