"""The kinds of contact surface."""

from __future__ import annotations

from enum import StrEnum


class SurfaceKind(StrEnum):
    """Use of a contact surface, which follows from the slope of its outward normal."""

    SUPPORT = "support"
    """Roughly level: limbs stand on it."""

    LEAN = "lean"
    """Roughly vertical: limbs lean on it."""

    OTHER = "other"
    """Neither, or too small: an obstacle, unless the limb may use surfaces of this kind."""
