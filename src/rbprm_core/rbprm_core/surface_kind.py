"""The words that every room uses for the same thing."""

from __future__ import annotations

from enum import StrEnum


class SurfaceKind(StrEnum):
    """What a contact surface is good for, by its outward normal."""

    SUPPORT = "support"
    LEAN = "lean"
    OTHER = "other"
    """Nothing can stand or lean on it: an obstacle only."""
