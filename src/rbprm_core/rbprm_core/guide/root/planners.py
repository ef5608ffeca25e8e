"""The guide planners by name."""

from __future__ import annotations

from collections.abc import Callable

from rbprm_core.guide.guide_options import GuideOptions
from rbprm_core.guide.roadmap import Roadmap
from rbprm_core.guide.root.prm import PrmSearch
from rbprm_core.guide.root.rrt import RrtSearch
from rbprm_core.guide.root.search import GuideSearch, RootProblem

PLANNERS: dict[str, Callable[[RootProblem, GuideOptions, Callable[[], Roadmap]], GuideSearch]] = {
    "rrt": lambda problem, options, roadmap: RrtSearch(problem, options.rrt),
    "prm": lambda problem, options, roadmap: PrmSearch(problem, roadmap(), options.prm),
}


def make_search(
    problem: RootProblem, options: GuideOptions, roadmap: Callable[[], Roadmap] = Roadmap
) -> GuideSearch:
    """The guide planner that the options name, at work on a problem.

    Args:
        roadmap: gives the roadmap to work on, opened for the problem's scene; called only by a
            planner that uses one.
    """
    return PLANNERS[options.planner](problem, options, roadmap)
