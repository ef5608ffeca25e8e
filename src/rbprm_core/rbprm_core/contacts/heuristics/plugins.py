"""Heuristics of other packages, found by their entry points."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib.metadata import EntryPoint, entry_points

import numpy as np
from numpy.typing import NDArray

from rbprm_core.contacts.heuristics.candidates import Candidates
from rbprm_core.errors import InvalidInput, RbprmError

GROUP = "rbprm.heuristics"
"""Entry points of this group are heuristics, known by the entry point's name."""


@dataclass(frozen=True)
class Plugin:
    """A heuristic that another package brings; holds it to what a heuristic has to give.

    Attributes:
        name: of the entry point. source: where it comes from, for errors.
        distribution, version: of the package that brings it.
        function: what the entry point names.
    """

    name: str
    source: str
    distribution: str
    version: str
    function: Callable[[Candidates], object]

    def __call__(self, candidates: Candidates) -> NDArray[np.float64]:
        """One finite number a candidate, (m,).

        Raises:
            InvalidInput: the plug-in fails, or gives something else.
        """
        field = f"heuristics.{self.name}"
        try:
            given = self.function(candidates)
        except RbprmError:
            raise
        except Exception as error:
            reason = f"the plug-in failed: {type(error).__name__}: {error}"
            raise InvalidInput(field, self.source, reason) from error
        try:
            values = np.array(given, dtype=float)
        except (TypeError, ValueError) as error:
            reason = f"the plug-in must give an array of numbers, gave {type(given).__name__}"
            raise InvalidInput(field, self.source, reason) from error
        if values.shape != (len(candidates),):
            reason = "the plug-in must give one number a candidate, "
            reason += f"shape ({len(candidates)},), gave {values.shape}"
            raise InvalidInput(field, self.source, reason)
        if not np.isfinite(values).all():
            worst = int(np.flatnonzero(~np.isfinite(values))[0])
            reason = f"the plug-in must give finite numbers, gave {values[worst]} for candidate "
            raise InvalidInput(field, self.source, f"{reason}{worst}")
        return values


def plugin_names() -> list[str]:
    """Names of the plug-ins that installed packages bring."""
    return sorted(entry_points(group=GROUP).names)


@cache
def load_plugin(name: str) -> Plugin | None:
    """The plug-in of a name; None where no package brings one.

    Raises:
        InvalidInput: two packages bring it, it cannot be imported, or it is no function.
    """
    found = list({_source(point): point for point in entry_points(group=GROUP, name=name)}.items())
    if not found:
        return None
    field = f"heuristics.{name}"
    if len(found) > 1:
        sources = ", ".join(source for source, _ in found)
        raise InvalidInput(field, sources, "two plug-ins have this name: uninstall one of them")
    source, point = found[0]
    try:
        function = point.load()
    except Exception as error:
        reason = f"the plug-in cannot be loaded: {type(error).__name__}: {error}"
        raise InvalidInput(field, source, reason) from error
    if not callable(function):
        reason = f"the plug-in must be a function of the candidates, is {type(function).__name__}"
        raise InvalidInput(field, source, reason)
    return Plugin(name, source, *_distribution(point), function)


def _source(point: EntryPoint) -> str:
    name, version = _distribution(point)
    return f"{point.value} of {name} {version}"


def _distribution(point: EntryPoint) -> tuple[str, str]:
    if point.dist is None:
        return "an unknown package", ""
    return point.dist.name, point.dist.version
