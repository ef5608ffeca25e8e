"""Options of the along-guide contact planner."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from pydantic import Field

from rbprm_core.validation import MAX_COORDINATE, MAX_COUNT, Length, PositiveLength, Step


@dataclass(frozen=True)
class GeneratorOptions:
    """Options of the contact generator.

    Attributes:
        band: largest distance of a sample from a surface to be a candidate, metres.
        tilt: largest angle between the normal of a patch and that of the surface for a sample to
            be a candidate, radians.
        edge_margin: smallest distance of a contact from the boundary of its surface, metres.
        candidates: largest number of candidates projected for one contact.
        spacing: spacing of the candidates on a surface, metres; of candidates nearer to each other
            only the best is tried, since what obstructs one mostly obstructs the other.
        move: smallest distance of a new contact from the one that it replaces, metres.
        accept_below_threshold: where no candidate reaches the threshold, take the one with the
            largest b0 that is in static equilibrium at all (b0 >= 0), as
            Tonneau et al. 2018, section 6.2.3, allow, rather than none.
    """

    band: PositiveLength = 0.04
    tilt: Annotated[float, Field(gt=0, le=1.5)] = 0.7
    edge_margin: Length = 0.01
    candidates: Annotated[int, Field(ge=1, le=MAX_COUNT)] = 60
    spacing: Step = 0.04
    move: Annotated[float, Field(ge=0.002, le=MAX_COORDINATE)] = 0.02
    accept_below_threshold: bool = False


@dataclass(frozen=True)
class SequenceOptions:
    """Options of the sequence.

    Attributes:
        step: distance of root configurations along the guide, metres (Tonneau et al. 2018, section
            6.2.4).
        min_step: length down to which a step that fails is halved, metres.
        look_ahead: length of the guide ahead by which contacts are ranked, metres.
        prefer_supported: move a contact without which the robot stays in equilibrium first; false
            keeps the order of Tonneau et al. 2018, with fewer transitions and less time.
        root_slack: largest distance of the root from the guide, metres, at the goal too, so that a
            limb keeps its contact whose joints cannot follow the root, such as a knee.
    """

    step: Step = 0.1
    min_step: Step = 0.0125
    look_ahead: Length = 0.4
    prefer_supported: bool = True
    root_slack: Length = 0.0
