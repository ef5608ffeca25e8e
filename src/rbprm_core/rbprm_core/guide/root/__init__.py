"""P1: a guide path of the root under the reachability condition (section 3)."""

from rbprm_core.guide.guide_options import GuideOptions, PrmOptions, RrtOptions
from rbprm_core.guide.roadmap import Roadmap, RoadmapStore
from rbprm_core.guide.root.edge import EdgeTest
from rbprm_core.guide.root.equilibrium import EquilibriumTest
from rbprm_core.guide.root.path import GuidePath
from rbprm_core.guide.root.reachability import Reachability
from rbprm_core.guide.root.sampler import RootSampler
from rbprm_core.guide.root.search import GuideSearch, RootProblem
from rbprm_core.guide.root.settle import Settler
from rbprm_core.guide.root.shortcut import shorten
from rbprm_core.guide.root_space import RootBounds, RootSpace

__all__ = [
    "EdgeTest",
    "EquilibriumTest",
    "GuideOptions",
    "GuidePath",
    "GuideSearch",
    "PrmOptions",
    "Reachability",
    "Roadmap",
    "RoadmapStore",
    "RootBounds",
    "RootProblem",
    "RootSampler",
    "RootSpace",
    "RrtOptions",
    "Settler",
    "shorten",
]
