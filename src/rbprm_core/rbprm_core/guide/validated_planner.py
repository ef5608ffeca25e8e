"""Guide planners of other packages, with their errors and results validated."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import numpy as np

from rbprm_core.arrays import Array
from rbprm_core.budget import Budget
from rbprm_core.errors import InvalidInput, RbprmError
from rbprm_core.failures import Failure
from rbprm_core.guide.protocol import Guide, GuidePlannerFactory, GuideProblem, GuideResult
from rbprm_core.guide.root_space import distance
from rbprm_core.registry import Plugin

T = TypeVar("T")

END_TOLERANCE = 1e-6  # m (rotations count as in `distance`)


class ValidatedGuidePlanner:
    """Guide planner of another package at work on one problem.

    An exception that is no `RbprmError`, or a guide that does not lead from start to goal, becomes
    an error that names the package.

    Args:
        plugin: factory of the other package, with its name.
        problem: problem to work on.

    Raises:
        InvalidInput: the planner fails.
    """

    def __init__(self, plugin: Plugin[GuidePlannerFactory], problem: GuideProblem) -> None:
        self._plugin, self._problem = plugin, problem
        self._planner = self._guarded(lambda: plugin.implementation(problem))

    def find(self, budget: Budget, rng: np.random.Generator, *, direct: bool = True) -> GuideResult:
        """See `GuidePlanner.find`.

        Raises:
            InvalidInput: the planner fails, or its guide is invalid.
        """
        return self._guarded(lambda: self._find(budget, rng, direct))

    def avoid(self, root: Array, keep: tuple[Array, ...]) -> None:
        """See `GuidePlanner.avoid`."""
        self._guarded(lambda: self._planner.avoid(root, keep))

    def forget(self) -> None:
        """See `GuidePlanner.forget`."""
        self._guarded(lambda: self._planner.forget())

    def failure(self, root: Array) -> Failure | None:
        """See `GuidePlanner.failure`."""
        return self._guarded(lambda: self._planner.failure(root))

    def trunk_failure(self, root: Array) -> Failure | None:
        """See `GuidePlanner.trunk_failure`."""
        return self._guarded(lambda: self._planner.trunk_failure(root))

    def _find(self, budget: Budget, rng: np.random.Generator, direct: bool) -> GuideResult:
        result = self._planner.find(budget, rng, direct=direct)
        reason = _fault(result.guide, self._problem)
        if reason:
            raise self._invalid(f"the guide {reason}")
        return result

    def _guarded(self, call: Callable[[], T]) -> T:
        """Result of a call; an exception of the plug-in's own becomes `InvalidInput`."""
        try:
            return call()
        except RbprmError:
            raise
        except Exception as error:
            raise self._invalid(f"the plug-in failed: {type(error).__name__}: {error}") from error

    def _invalid(self, reason: str) -> InvalidInput:
        return InvalidInput(f"guide_planners.{self._plugin.name}", self._plugin.source, reason)


def _fault(guide: Guide, problem: GuideProblem) -> str:
    """Text that says what is wrong with a guide; "" where nothing is."""
    length, nodes = guide.length, np.asarray(guide.nodes)
    if not (np.isfinite(length) and length >= 0):
        return f"has length {length}"
    if nodes.ndim != 2 or nodes.shape[1:] != problem.start.shape:
        return f"has nodes of shape {nodes.shape}, must be (n, {len(problem.start)})"
    if not np.isfinite(nodes).all():
        return "has nodes that are not finite"
    for name, s, wanted in (("start", 0.0, problem.start), ("goal", length, problem.goal)):
        root = np.asarray(guide.root(s))
        if root.shape != wanted.shape:
            return f"has a root of shape {root.shape} at its {name}, must be {wanted.shape}"
        if not float(distance(root, wanted)) <= END_TOLERANCE:
            return f"does not contain the {name}"
    return ""
