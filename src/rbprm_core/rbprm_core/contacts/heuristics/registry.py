"""Heuristics by name: those of this package, and those of other packages."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from rbprm_core.arrays import Array, IntArray
from rbprm_core.contacts.heuristics.candidates import Candidates
from rbprm_core.contacts.heuristics.effort import effort
from rbprm_core.contacts.heuristics.joint_limits import joint_limits
from rbprm_core.contacts.heuristics.manipulability import manipulability
from rbprm_core.contacts.heuristics.nominal import nominal
from rbprm_core.contacts.heuristics.persistence import persistence
from rbprm_core.contacts.heuristics.random import random
from rbprm_core.contacts.heuristics.reference import reference
from rbprm_core.contacts.heuristics.velocity import velocity
from rbprm_core.errors import InvalidInput, RbprmError
from rbprm_core.registry import Plugin, Registry

Heuristic = Callable[[Candidates], Array]

BUILTIN: dict[str, Heuristic] = {
    "effort": effort,
    "velocity": velocity,
    "manipulability": manipulability,
    "nominal": nominal,
    "persistence": persistence,
    "reference": reference,
    "joint_limits": joint_limits,
    "random": random,
}
"""The heuristics of this package."""

HEURISTICS: Registry[Heuristic] = Registry("heuristic", "rbprm.heuristics", BUILTIN)
"""All heuristics; an entry point of the group "rbprm.heuristics" adds one."""


def check_names(weights: Mapping[str, float], field: str) -> None:
    """Test that every weight names a heuristic.

    Args:
        weights: weight by name of heuristic.
        field: field of the input that holds the weights, for the error.

    Raises:
        InvalidInput: an unknown heuristic, or one of another package that cannot be loaded.
    """
    for name in weights:
        HEURISTICS.get(name, field)


def rank(candidates: Candidates, weights: Mapping[str, float]) -> IntArray:
    """Order (m,) of candidates, best first, by the weighted sum of heuristics.

    Each heuristic is divided by its largest magnitude over the candidates, so that weights compare
    shares and not units. Ties keep the order of the sample database.

    Args:
        candidates: the candidates.
        weights: weight by name of heuristic.

    Raises:
        InvalidInput: a heuristic of another package fails, or does not return one finite number a
            candidate.
    """
    total = np.zeros(len(candidates))
    for name, weight in weights.items():
        values = _values(name, candidates)
        total += weight * values / max(float(np.abs(values).max(initial=0.0)), 1e-12)
    return np.argsort(-total, kind="stable")


def _values(name: str, candidates: Candidates) -> Array:
    """Values (m,) of a heuristic; those of another package are validated."""
    plugin = HEURISTICS.plugin(name)
    if plugin is None:
        return BUILTIN[name](candidates)
    return _validated(plugin, candidates)


def _validated(plugin: Plugin[Heuristic], candidates: Candidates) -> Array:
    """Values (m,) of a heuristic of another package: one finite number a candidate.

    Raises:
        InvalidInput: it fails, or returns something else.
    """
    field = f"heuristics.{plugin.name}"
    try:
        returned: object = plugin.implementation(candidates)
    except RbprmError:
        raise
    except Exception as error:
        reason = f"the plug-in failed: {type(error).__name__}: {error}"
        raise InvalidInput(field, plugin.source, reason) from error
    try:
        values = np.array(returned, dtype=float)
    except (TypeError, ValueError) as error:
        reason = f"the plug-in must return an array of numbers, not {type(returned).__name__}"
        raise InvalidInput(field, plugin.source, reason) from error
    if values.shape != (len(candidates),):
        reason = (
            f"the plug-in must return one number a candidate, shape ({len(candidates)},), "
            f"not {values.shape}"
        )
        raise InvalidInput(field, plugin.source, reason)
    if not np.isfinite(values).all():
        worst = int(np.flatnonzero(~np.isfinite(values))[0])
        reason = (
            f"the plug-in must return finite numbers, not {values[worst]} for candidate {worst}"
        )
        raise InvalidInput(field, plugin.source, reason)
    return values
