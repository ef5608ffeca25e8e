"""Guide planners by name: those of this package, and those of other packages."""

from __future__ import annotations

from rbprm_core.guide.protocol import GuidePlanner, GuidePlannerFactory, GuideProblem
from rbprm_core.guide.root.root_planner import prm_planner, rrt_planner
from rbprm_core.guide.validated_planner import ValidatedGuidePlanner
from rbprm_core.registry import Registry

GUIDE_PLANNERS: Registry[GuidePlannerFactory] = Registry(
    "guide planner", "rbprm.guide_planners", {"rrt": rrt_planner, "prm": prm_planner}
)
"""Factories of guide planners; an entry point of the group "rbprm.guide_planners" adds one."""


def guide_planner(name: str, problem: GuideProblem, field: str = "stages.guide") -> GuidePlanner:
    """The guide planner of a name at work on a problem.

    Results of a planner of another package are validated.

    Args:
        name: name of the guide planner.
        problem: problem to work on.
        field: field of the input that holds the name, for the error.

    Raises:
        InvalidInput: unknown name, or a planner of another package that fails.
    """
    factory, plugin = GUIDE_PLANNERS.get(name, field), GUIDE_PLANNERS.plugin(name)
    return factory(problem) if plugin is None else ValidatedGuidePlanner(plugin, problem)
