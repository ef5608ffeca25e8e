"""Heuristics that rank contact candidates, by name; one file each (section 5.2)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from rbprm_core.contacts.heuristics.candidates import Candidates
from rbprm_core.contacts.heuristics.effort import effort
from rbprm_core.contacts.heuristics.joint_limits import joint_limits
from rbprm_core.contacts.heuristics.manipulability import manipulability
from rbprm_core.contacts.heuristics.nominal import nominal
from rbprm_core.contacts.heuristics.persistence import persistence
from rbprm_core.contacts.heuristics.plugins import Plugin, load_plugin, plugin_names
from rbprm_core.contacts.heuristics.random import random
from rbprm_core.contacts.heuristics.reference import reference
from rbprm_core.contacts.heuristics.velocity import velocity
from rbprm_core.errors import InvalidInput

__all__ = [
    "HEURISTICS",
    "Candidates",
    "Heuristic",
    "check_names",
    "heuristic",
    "plugin_versions",
    "rank",
]

Heuristic = Callable[[Candidates], NDArray[np.float64]]

HEURISTICS: dict[str, Heuristic] = {
    "effort": effort,
    "velocity": velocity,
    "manipulability": manipulability,
    "nominal": nominal,
    "persistence": persistence,
    "reference": reference,
    "joint_limits": joint_limits,
    "random": random,
}
"""Those that come with the package; a plug-in of the same name is never asked for."""


def heuristic(name: str) -> Heuristic | None:
    """The heuristic of a name, of this package or a plug-in; None where there is none.

    Raises:
        InvalidInput: a plug-in that cannot be loaded; names it and its package.
    """
    return HEURISTICS.get(name) or load_plugin(name)


def check_names(weights: Mapping[str, float], field: str) -> None:
    """Raise `InvalidInput` where a weight names no heuristic, or one that cannot be loaded."""
    for name in weights:
        if heuristic(name) is None:
            known = ", ".join([*HEURISTICS, *plugin_names()])
            raise InvalidInput(field, name, f"unknown heuristic; known: {known}")


def plugin_versions(names: Iterable[str]) -> dict[str, str]:
    """Version by package of the plug-ins among the heuristics named."""
    found = [heuristic(name) for name in names]
    return {plugin.distribution: plugin.version for plugin in found if isinstance(plugin, Plugin)}


def rank(candidates: Candidates, weights: Mapping[str, float]) -> NDArray[np.int_]:
    """Order (m,) of candidates, best first, by the weighted sum of the named heuristics.

    Each heuristic is divided by its largest magnitude over the candidates, so that weights compare
    shares and not units. Ties keep the database's order.

    Raises:
        InvalidInput: a plug-in that fails, or gives something else than one number a candidate.
    """
    total = np.zeros(len(candidates))
    for name, weight in weights.items():
        function = heuristic(name)
        assert function is not None  # `check_names` has looked
        values = function(candidates)
        total += weight * values / max(float(np.abs(values).max(initial=0.0)), 1e-12)
    return np.argsort(-total, kind="stable")
