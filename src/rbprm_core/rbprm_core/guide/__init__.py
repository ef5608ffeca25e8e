"""P1: a guide path of the root under the reachability condition (section 3)."""

from rbprm_core.guide.edge import EdgeTest
from rbprm_core.guide.equilibrium import EquilibriumTest
from rbprm_core.guide.options import GuideOptions, PrmOptions, RrtOptions
from rbprm_core.guide.path import GuidePath
from rbprm_core.guide.reachability import Reachability
from rbprm_core.guide.roadmap import Roadmap, RoadmapStore
from rbprm_core.guide.sampler import RootSampler
from rbprm_core.guide.search import GuideProblem, GuideSearch
from rbprm_core.guide.settle import Settler
from rbprm_core.guide.shortcut import shorten
from rbprm_core.guide.space import RootBounds, RootSpace

__all__ = [
    "EdgeTest",
    "EquilibriumTest",
    "GuideOptions",
    "GuidePath",
    "GuideProblem",
    "GuideSearch",
    "PrmOptions",
    "Reachability",
    "Roadmap",
    "RoadmapStore",
    "RootBounds",
    "RootSampler",
    "RootSpace",
    "RrtOptions",
    "Settler",
    "shorten",
]
