"""Options of the guide planners."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Literal

from pydantic import Field

from rbprm_core.validation import MAX_COUNT, Step


@dataclass(frozen=True)
class RrtOptions:
    """Options of the bidirectional RRT.

    Attributes:
        step: most metres that a tree grows at once.
        iterations: samples drawn before the search is given up.
    """

    step: Step = 0.4
    iterations: Annotated[int, Field(ge=2, le=MAX_COUNT)] = 2_000


@dataclass(frozen=True)
class PrmOptions:
    """Options of the visibility roadmap.

    Attributes:
        neighbours: nearest nodes of each part of the roadmap to which a new one is tried.
        iterations: samples drawn in one request before the search is given up.
    """

    neighbours: Annotated[int, Field(ge=1, le=MAX_COUNT)] = 4
    iterations: Annotated[int, Field(ge=1, le=MAX_COUNT)] = 2_000


@dataclass(frozen=True)
class GuideOptions:
    """Options of the guide (P1).

    Attributes:
        planner: name of the guide planner: rrt, or prm, whose roadmap can be kept.
        resolution: metres between the points of an edge at which the limbs' reach is tested.
        equilibrium: ask of those points, too, that contacts within the limbs' workspaces could
            hold the robot in static equilibrium.
        rrt: of the planner rrt.
        prm: of the planner prm.
    """

    planner: Literal["rrt", "prm"] = "rrt"
    resolution: Step = 0.05
    equilibrium: bool = False
    rrt: RrtOptions = field(default_factory=RrtOptions)
    prm: PrmOptions = field(default_factory=PrmOptions)
