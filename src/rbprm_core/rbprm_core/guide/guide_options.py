"""Options of the guide planners."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

from pydantic import Field

from rbprm_core.validation import MAX_COUNT, Step


@dataclass(frozen=True)
class RrtOptions:
    """Options of the bidirectional RRT.

    Attributes:
        step: maximum length of a tree's edge, metres.
        iterations: maximum number of samples drawn in one search.
    """

    step: Step = 0.4
    iterations: Annotated[int, Field(ge=2, le=MAX_COUNT)] = 2_000


@dataclass(frozen=True)
class PrmOptions:
    """Options of the visibility roadmap.

    Attributes:
        neighbours: number of nearest nodes of each connected component of the roadmap that are
            tried for edges to a new node.
        iterations: maximum number of samples drawn in one search.
    """

    neighbours: Annotated[int, Field(ge=1, le=MAX_COUNT)] = 4
    iterations: Annotated[int, Field(ge=1, le=MAX_COUNT)] = 2_000


@dataclass(frozen=True)
class GuideOptions:
    """Options of the guide (P1).

    Attributes:
        resolution: distance between the points of an edge at which the limbs' reach is tested,
            metres.
        equilibrium: require at every fourth of those points, too, that contacts within the limbs'
            workspaces could hold the robot in static equilibrium.
        shortcuts: number of random shortcuts tried on a guide.
        settle: move the roots of a guide towards the reference posture's height over the surfaces.
        rrt: options of the planner "rrt".
        prm: options of the planner "prm".
    """

    resolution: Step = 0.05
    equilibrium: bool = False
    shortcuts: Annotated[int, Field(ge=0, le=MAX_COUNT)] = 100
    settle: bool = True
    rrt: RrtOptions = field(default_factory=RrtOptions)
    prm: PrmOptions = field(default_factory=PrmOptions)
