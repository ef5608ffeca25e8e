"""Random shortcuts: cut corners of a guide path where the straight way holds."""

from __future__ import annotations

import numpy as np

from rbprm_core.budget import Budget
from rbprm_core.guide.root.edge import EdgeTest
from rbprm_core.guide.root.path import GuidePath
from rbprm_core.guide.root_space import StraightWay

MIN_GAIN = 0.01  # share of the way; a smaller one is not worth the test of an edge


def shorten(
    path: GuidePath, edges: EdgeTest, loops: int, budget: Budget, rng: np.random.Generator
) -> GuidePath:
    """Try `loops` times to join two random points of the path by a straight edge."""
    for i in range(loops):
        budget.check("shortcut", i / loops)
        if len(path.nodes) == 2:
            break
        first, second = np.sort(rng.uniform(0, path.length, 2))
        a, b = path.at(first), path.at(second)
        # Two points of one edge are as far apart as the path between them: nothing to gain.
        if StraightWay(a, b).length < (1 - MIN_GAIN) * (second - first) and edges.holds(a, b):
            before, after = path.marks <= first, path.marks >= second
            path = GuidePath(np.concatenate([path.nodes[before], [a, b], path.nodes[after]]))
    return path
