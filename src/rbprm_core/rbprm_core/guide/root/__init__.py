"""Guide planners for paths of the root under the reachability condition (Tonneau et al. 2018)."""

from rbprm_core.guide.guide_options import GuideOptions, PrmOptions, RrtOptions
from rbprm_core.guide.roadmap import Roadmap, RoadmapStore
from rbprm_core.guide.root.edge import EdgeTest
from rbprm_core.guide.root.path import GuidePath
from rbprm_core.guide.root.reachability import Reachability
from rbprm_core.guide.root.root_equilibrium import EquilibriumTest
from rbprm_core.guide.root.root_planner import RootGuidePlanner
from rbprm_core.guide.root.sampler import RootSampler
from rbprm_core.guide.root.search import RootProblem, RootSearch
from rbprm_core.guide.root.settle import Settler
from rbprm_core.guide.root.shortcut import shorten
from rbprm_core.guide.root_space import RootBounds, RootSpace

__all__ = [
    "EdgeTest",
    "EquilibriumTest",
    "GuideOptions",
    "GuidePath",
    "PrmOptions",
    "Reachability",
    "Roadmap",
    "RoadmapStore",
    "RootBounds",
    "RootGuidePlanner",
    "RootProblem",
    "RootSampler",
    "RootSearch",
    "RootSpace",
    "RrtOptions",
    "Settler",
    "shorten",
]
