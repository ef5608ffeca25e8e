"""Interface of the guide stage (P1): its problem, its planner and the guide that it finds.

The pipeline and the contact planners use only what stands here. An implementation is chosen by
name, see `rbprm_core.guide.registry`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from rbprm_core.arrays import Array
from rbprm_core.budget import Budget
from rbprm_core.counters import Counters
from rbprm_core.failures import Failure
from rbprm_core.guide.guide_options import GuideOptions
from rbprm_core.guide.roadmap import RoadmapStore
from rbprm_core.guide.root_space import RootSpace
from rbprm_core.robot.data import RobotData
from rbprm_core.scene import Scene


class Guide(Protocol):
    """A path of the root from start to goal, parametrised by its arc length s.

    s runs from 0 to `length` in metres; rotations and joint motions count as in
    `rbprm_core.guide.root_space.distance`. Outside of that range s is clamped to it.
    """

    @property
    def length(self) -> float:
        """Length of the guide, m."""

    @property
    def nodes(self) -> Array:
        """Root configurations (n, 7 + j) from start to goal that are recorded in the plan."""

    def root(self, s: float) -> Array:
        """Root configuration (7 + j,) at arc length s.

        Args:
            s: arc length, m.
        """

    def roots(self, s: Array) -> Array:
        """Root configurations (n, 7 + j) at arc lengths.

        Args:
            s: (n,) arc lengths, m.
        """

    def posture(self, s: float) -> Array | None:
        """Whole configuration (nq,) at arc length s; None where the guide holds only roots.

        Args:
            s: arc length, m.
        """


@dataclass(frozen=True, eq=False)
class GuideProblem:
    """Input of a guide planner.

    Attributes:
        data: robot with its trunk volumes, limb workspaces and limb samples.
        scene: supporting surfaces and obstacles, in the planning frame.
        start: (7 + j,) root configuration from which guides start.
        goal: (7 + j,) root configuration at which guides end.
        space: bounds of the root and of the joints that are planned with it.
        required_limbs: names of the limbs that must be able to reach a surface along the guide.
        gravity: (3,) gravity in the planning frame, m/s^2.
        options: options of the guide planners.
        budget: time limit and cancel flag, polled while the planner is built and in its
            feasibility tests.
        roadmaps: roadmaps that the caller keeps between requests; None where it keeps none.
        counters: receives the seconds that the planner spends on shortening and settling guides,
            under `Stage.SHORTCUT`; they are reported apart from those of the search.
    """

    data: RobotData
    scene: Scene
    start: Array
    goal: Array
    space: RootSpace
    required_limbs: tuple[str, ...]
    gravity: Array
    options: GuideOptions = field(default_factory=GuideOptions)
    budget: Budget = field(default_factory=Budget)
    roadmaps: RoadmapStore | None = None
    counters: Counters = field(default_factory=Counters)


@dataclass(frozen=True, eq=False)
class GuideResult:
    """Output of one search for a guide.

    Attributes:
        guide: the guide, shortened and settled as its planner does.
        nodes: number of nodes of the search (tree or roadmap) that found it, for the statistics.
    """

    guide: Guide
    nodes: int


class GuidePlanner(Protocol):
    """A guide planner at work on one problem.

    `find` is called again after a contact planner has failed to follow a guide; `avoid` then says
    where the failure arose.
    """

    def find(self, budget: Budget, rng: np.random.Generator, *, direct: bool = True) -> GuideResult:
        """A guide from start to goal.

        Equal problems and random states give equal guides; with kept roadmaps, the guide depends
        on the roadmaps' earlier use, too.

        Args:
            budget: checked often (stage "guide" or "shortcut"), so that cancelling takes effect
                within a tenth of a second.
            rng: the only source of random numbers.
            direct: True to try the straight segment from start to goal first. False after a guide
                has failed, to get a different one.

        Raises:
            NoGuideFound: the search ended without a guide.
            TimeLimitReached: raised by the budget.
            Cancelled: raised by the budget.
        """

    def avoid(self, root: Array, keep: tuple[Array, ...]) -> None:
        """Keep later guides away from a root configuration at which a contact planner failed.

        Args:
            root: (7 + j,) root configuration.
            keep: root configurations (start and goal) whose neighbourhood stays allowed.
        """

    def forget(self) -> None:
        """Allow again all root configurations passed to `avoid`."""

    def failure(self, root: Array) -> Failure | None:
        """Why no guide may pass a root configuration, None where one may.

        Args:
            root: (7 + j,) root configuration.
        """

    def trunk_failure(self, root: Array) -> Failure | None:
        """Why the robot's trunk cannot be at a root configuration, None where it can.

        For a root that is known to admit contacts, `failure` tests too much.

        Args:
            root: (7 + j,) root configuration.
        """


GuidePlannerFactory = Callable[[GuideProblem], GuidePlanner]
"""Makes a guide planner for one problem; start and goal are tested later, by `failure`."""
