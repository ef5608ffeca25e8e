"""Motion planners by name. This package brings none yet; other packages may."""

from __future__ import annotations

from rbprm_core.motion.protocol import MotionPlannerFactory
from rbprm_core.registry import Registry

MOTION_PLANNERS: Registry[MotionPlannerFactory] = Registry(
    "motion planner", "rbprm.motion_planners", {}
)
"""Factories of motion planners; entry points of "rbprm.motion_planners" add them."""
