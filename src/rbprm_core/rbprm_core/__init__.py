"""Reachability-based acyclic multi-contact planning for legged robots.

    import rbprm_core as rbprm

    robot = rbprm.load_robot("hyq")
    scene = rbprm.Scene.from_mesh("terrain.stl")
    plan = rbprm.plan(robot, scene, start=(-2, 0, 0.63), goal=(3, 0, 0.63))
    plan.check()
    plan.save("a.plan.json")

Stable from one release to the next are the names in `__all__`, the command line, the formats of
plan, scenario and robot files, and the messages, services and parameters of the node: what changes
keeps its old name for one release, with a warning. Modules below this one may change in any
release.

The names are loaded at first use, so that importing the package takes no time.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rbprm_core.api import Plan, Scene, load_robot, plan
    from rbprm_core.check import CheckReport
    from rbprm_core.errors import (
        GoalUnreachable,
        InvalidInput,
        NoGuideFound,
        NoSequenceFound,
        RbprmError,
        StartUnreachable,
        TimeLimitReached,
    )
    from rbprm_core.guide.root_space import RootBounds
    from rbprm_core.placement import Placement
    from rbprm_core.request import PlannerOptions
    from rbprm_core.robot import Robot
    from rbprm_core.scene import Classification
    from rbprm_core.version import __version__

__all__ = [
    "CheckReport",
    "Classification",
    "GoalUnreachable",
    "InvalidInput",
    "NoGuideFound",
    "NoSequenceFound",
    "Placement",
    "Plan",
    "PlannerOptions",
    "RbprmError",
    "Robot",
    "RootBounds",
    "Scene",
    "StartUnreachable",
    "TimeLimitReached",
    "__version__",
    "load_robot",
    "plan",
]

_ERRORS = (
    "GoalUnreachable",
    "InvalidInput",
    "NoGuideFound",
    "NoSequenceFound",
    "RbprmError",
    "StartUnreachable",
    "TimeLimitReached",
)
_MODULES = {
    **dict.fromkeys(("Plan", "Scene", "load_robot", "plan"), "api"),
    **dict.fromkeys(_ERRORS, "errors"),
    "CheckReport": "check",
    "Classification": "scene",
    "Placement": "placement",
    "PlannerOptions": "request",
    "Robot": "robot",
    "RootBounds": "guide.root_space",
    "__version__": "version",
}
"""Module below this package that holds each name."""


def __getattr__(name: str) -> Any:
    """A public name, loaded at first use."""
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{_MODULES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """The public names."""
    return sorted(__all__)
