"""Heuristics that rank contact candidates, by name; one file each (section 5.2)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from rbprm_core.contacts.heuristics.candidates import Candidates
from rbprm_core.contacts.heuristics.effort import effort
from rbprm_core.contacts.heuristics.manipulability import manipulability
from rbprm_core.contacts.heuristics.nominal import nominal
from rbprm_core.contacts.heuristics.persistence import persistence
from rbprm_core.errors import InvalidInput

__all__ = ["HEURISTICS", "Candidates", "Heuristic", "rank"]

Heuristic = Callable[[Candidates], NDArray[np.float64]]

HEURISTICS: dict[str, Heuristic] = {
    "effort": effort,
    "manipulability": manipulability,
    "nominal": nominal,
    "persistence": persistence,
}


def check_names(weights: dict[str, float], field: str) -> None:
    """Raise `InvalidInput` where a weight names no heuristic."""
    for name in weights:
        if name not in HEURISTICS:
            raise InvalidInput(field, name, f"unknown heuristic; known: {', '.join(HEURISTICS)}")


def rank(candidates: Candidates, weights: dict[str, float]) -> NDArray[np.int_]:
    """Order (m,) of candidates, best first, by the weighted sum of the named heuristics.

    Each heuristic is divided by its largest magnitude over the candidates, so that weights compare
    shares and not units. Ties keep the database's order.
    """
    total = np.zeros(len(candidates.normals))
    for name, weight in weights.items():
        values = HEURISTICS[name](candidates)
        total += weight * values / max(float(np.abs(values).max(initial=0.0)), 1e-12)
    return np.argsort(-total, kind="stable")
