"""Guide planners by name: those of this package, and those of other packages."""

from __future__ import annotations

from rbprm_core.guide.protocol import GuidePlannerFactory
from rbprm_core.guide.root.root_planner import prm_planner, rrt_planner
from rbprm_core.registry import Registry

GUIDE_PLANNERS: Registry[GuidePlannerFactory] = Registry(
    "guide planner", "rbprm.guide_planners", {"rrt": rrt_planner, "prm": prm_planner}
)
"""Factories of guide planners; an entry point of the group "rbprm.guide_planners" adds one."""
