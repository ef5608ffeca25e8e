"""Options of the contact generator and of the sequence."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from pydantic import Field

from rbprm_core.validation import MAX_COORDINATE, MAX_COUNT, Length, PositiveLength, Step


@dataclass(frozen=True)
class GeneratorOptions:
    """Options of the contact generator.

    Attributes:
        band: samples farther than this from a surface are no candidates, metres.
        tilt: samples of a patch that face the surface less well than this are none, radians.
        edge_margin: least distance of a contact from its surface's boundary, metres.
        candidates: most candidates that are projected for one contact.
        spacing: of the candidates on a surface, metres; of those that are nearer to each other
            only the best is tried, since what blocks one mostly blocks the other.
        move: a new contact nearer than this to the one it replaces is no move, metres.
        accept_below_threshold: where no candidate reaches the threshold, take the one with the
            largest b0 that is in static equilibrium at all (b0 >= 0), as section 6.2.3 allows,
            rather than none.
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
        step: distance of root configurations along the guide, metres (section 6.2.4).
        min_step: a step that fails is halved down to this, metres.
        look_ahead: metres of guide ahead by which contacts are ranked.
        prefer_supported: rather move a contact without which the robot still stands; false keeps to
            the paper's order, with fewer transitions and less time.
        root_slack: how far the root may leave the guide, metres, at the goal too, so that a limb
            keeps its contact whose joints cannot follow the root, such as a knee's.
    """

    step: Step = 0.1
    min_step: Step = 0.0125
    look_ahead: Length = 0.4
    prefer_supported: bool = True
    root_slack: Length = 0.0
