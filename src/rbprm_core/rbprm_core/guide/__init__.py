"""P1: a guide path of the root under the reachability condition (section 3)."""

from rbprm_core.guide.path import GuidePath
from rbprm_core.guide.reachability import Reachability
from rbprm_core.guide.rrt import RrtOptions, plan_rrt
from rbprm_core.guide.settle import Settler
from rbprm_core.guide.shortcut import shorten
from rbprm_core.guide.space import RootBounds, RootSpace

__all__ = [
    "GuidePath",
    "Reachability",
    "RootBounds",
    "RootSpace",
    "RrtOptions",
    "Settler",
    "plan_rrt",
    "shorten",
]
