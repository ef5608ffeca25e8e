"""Colours of page, picture and markers; limb colours suit colour-blind readers (Okabe and Ito)."""

from __future__ import annotations

LIMBS = ("#d55e00", "#0072b2", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
BODY = "#6b7682"
GROUND = "#d9d4c8"
GROUND_EDGE = "#8d8778"
GUIDE = "#3b3f45"
INK = "#2b2f36"
BAD = "#c0202a"


def limb_colors(limbs: tuple[str, ...]) -> dict[str, str]:
    """Return a colour for each limb.

    Args:
        limbs: names of the limbs.
    """
    return {limb: LIMBS[i % len(LIMBS)] for i, limb in enumerate(limbs)}
