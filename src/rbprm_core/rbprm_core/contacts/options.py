"""Options of the contact generator."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from pydantic import Field


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
    """

    band: Annotated[float, Field(gt=0)] = 0.04
    tilt: Annotated[float, Field(gt=0, le=1.5)] = 0.7
    edge_margin: Annotated[float, Field(ge=0)] = 0.01
    candidates: Annotated[int, Field(ge=1)] = 60
    spacing: Annotated[float, Field(gt=0)] = 0.04
    move: Annotated[float, Field(ge=0.002)] = 0.02
