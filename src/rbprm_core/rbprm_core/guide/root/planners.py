"""The guide planners by name."""

from __future__ import annotations

from collections.abc import Callable

from rbprm_core.guide.root.options import GuideOptions
from rbprm_core.guide.root.prm import PrmSearch
from rbprm_core.guide.root.roadmap import Roadmap
from rbprm_core.guide.root.rrt import RrtSearch
from rbprm_core.guide.root.search import GuideProblem, GuideSearch

PLANNERS: dict[str, Callable[[GuideProblem, GuideOptions, Callable[[], Roadmap]], GuideSearch]] = {
    "rrt": lambda problem, options, roadmap: RrtSearch(problem, options.rrt),
    "prm": lambda problem, options, roadmap: PrmSearch(problem, roadmap(), options.prm),
}


def make_search(
    problem: GuideProblem, options: GuideOptions, roadmap: Callable[[], Roadmap] = Roadmap
) -> GuideSearch:
    """The guide planner that the options name, at work on a problem.

    Args:
        roadmap: gives the roadmap to work on, opened for the problem's scene; called only by a
            planner that uses one.
    """
    return PLANNERS[options.planner](problem, options, roadmap)
