"""Implementations of one interface by name: those of this package, and those of other packages.

Other packages bring theirs as entry points, so that a guide planner, a contact planner or a
heuristic of a user's own is chosen by its name like any other.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from importlib.metadata import EntryPoint, entry_points
from typing import Generic, TypeVar

from rbprm_core.errors import InvalidInput

T = TypeVar("T")


@dataclass(frozen=True)
class Plugin(Generic[T]):
    """An implementation that another package brings.

    Attributes:
        name: name of the entry point.
        source: object, package and version of the entry point, for error texts.
        distribution: name of the package.
        version: version of the package.
        implementation: the object that the entry point names.
    """

    name: str
    source: str
    distribution: str
    version: str
    implementation: T


class Registry(Generic[T]):
    """The implementations of one interface.

    Args:
        kind: what is registered, in the singular, for error texts ("guide planner").
        group: entry-point group of other packages ("rbprm.guide_planners").
        builtin: implementations of this package by name; an entry point of the same name is
            never loaded.
    """

    def __init__(self, kind: str, group: str, builtin: Mapping[str, T]) -> None:
        self.kind, self.group = kind, group
        self._builtin = dict(builtin)
        self._plugins: dict[str, Plugin[T]] = {}

    def names(self) -> tuple[str, ...]:
        """Names of all implementations: this package's, then those of other packages, sorted."""
        return (*self._builtin, *sorted(set(self._points) - set(self._builtin)))

    def get(self, name: str, field: str) -> T:
        """The implementation of a name.

        Args:
            name: of the implementation.
            field: field of the input that holds the name, for the error.

        Raises:
            InvalidInput: unknown name (the text lists the known ones); an entry point that cannot
                be imported, that is not callable, or that two packages bring.
        """
        if name in self._builtin:
            return self._builtin[name]
        plugin = self.plugin(name)
        if plugin is None:
            known = ", ".join(self.names()) or "none"
            raise InvalidInput(field, name, f"unknown {self.kind}; known: {known}")
        return plugin.implementation

    def plugin(self, name: str) -> Plugin[T] | None:
        """The implementation of another package; None where no package brings the name.

        Args:
            name: of the entry point.

        Raises:
            InvalidInput: see `get`.
        """
        if name in self._builtin or name not in self._points:
            return None
        if name not in self._plugins:
            self._plugins[name] = self._load(name)
        return self._plugins[name]

    def versions(self, names: Iterable[str]) -> dict[str, str]:
        """Version by package of those of some implementations that other packages bring.

        Args:
            names: of implementations; names of this package's own are passed over.

        Raises:
            InvalidInput: see `get`.
        """
        plugins = [self.plugin(name) for name in names]
        return {p.distribution: p.version for p in plugins if p is not None}

    def clear(self) -> None:
        """Forget the entry points found, so that packages installed since are found."""
        self._plugins.clear()
        self.__dict__.pop("_points", None)

    @cached_property
    def _points(self) -> dict[str, list[EntryPoint]]:
        """Entry points of the group by name; the same one found twice counts once."""
        found: dict[str, dict[str, EntryPoint]] = {}
        for point in entry_points(group=self.group):
            found.setdefault(point.name, {})[_source(point)] = point
        return {name: list(points.values()) for name, points in found.items()}

    def _load(self, name: str) -> Plugin[T]:
        field, points = f"{self.group.split('.', 1)[-1]}.{name}", self._points[name]
        if len(points) > 1:
            sources = ", ".join(_source(point) for point in points)
            raise InvalidInput(field, sources, "two plug-ins have this name: uninstall one of them")
        point = points[0]
        try:
            implementation = point.load()
        except Exception as error:
            reason = f"the plug-in cannot be loaded: {type(error).__name__}: {error}"
            raise InvalidInput(field, _source(point), reason) from error
        if not callable(implementation):
            reason = f"the plug-in must be callable, is {type(implementation).__name__}"
            raise InvalidInput(field, _source(point), reason)
        return Plugin(name, _source(point), *_distribution(point), implementation)


def _source(point: EntryPoint) -> str:
    name, version = _distribution(point)
    return f"{point.value} of {name} {version}"


def _distribution(point: EntryPoint) -> tuple[str, str]:
    if point.dist is None:
        return "an unknown package", ""
    return point.dist.name, point.dist.version
