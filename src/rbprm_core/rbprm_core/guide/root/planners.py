"""The searches for root paths by name."""

from __future__ import annotations

from collections.abc import Callable

from rbprm_core.guide.guide_options import GuideOptions
from rbprm_core.guide.roadmap import Roadmap
from rbprm_core.guide.root.prm import PrmSearch
from rbprm_core.guide.root.rrt import RrtSearch
from rbprm_core.guide.root.search import RootProblem, RootSearch

PLANNERS: dict[str, Callable[[RootProblem, GuideOptions, Callable[[], Roadmap]], RootSearch]] = {
    "rrt": lambda problem, options, roadmap: RrtSearch(problem, options.rrt),
    "prm": lambda problem, options, roadmap: PrmSearch(problem, roadmap(), options.prm),
}


def make_search(
    problem: RootProblem, options: GuideOptions, roadmap: Callable[[], Roadmap] = Roadmap
) -> RootSearch:
    """The search that the options name, at work on a problem."""
    return PLANNERS[options.planner](problem, options, roadmap)
