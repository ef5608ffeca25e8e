"""Registry of implementations by name, with those of other packages from their entry points."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from rbprm_core.errors import InvalidInput
from rbprm_core.registry import Registry

GROUP = "rbprm.test_greetings"

MODULE = """
def hello():
    return "hello"

def other():
    return "other"

number = 3
"""

ENTRY_POINTS = """[{group}]
{prefix}hello = {module}:hello
plain = {module}:other
{prefix}number = {module}:number
{prefix}absent = {module}:absent
{prefix}no_module = {module}_2:hello
"""

Install = Callable[..., None]


@pytest.fixture
def registry() -> Registry[Callable[[], str]]:
    """Registry with one implementation of its own."""
    return Registry("greeting", GROUP, {"plain": lambda: "plain"})


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Install]:
    """Writes a package as pip installs it: a module, and the metadata of its distribution."""

    def write(module: str, prefix: str = "", version: str = "1.2") -> None:
        folder = tmp_path / f"{module}-{version}"
        info = folder / f"{module}-{version}.dist-info"
        info.mkdir(parents=True)
        (folder / f"{module}.py").write_text(MODULE)
        text = f"Metadata-Version: 2.1\nName: {module}\nVersion: {version}\n"
        (info / "METADATA").write_text(text)
        points = ENTRY_POINTS.format(group=GROUP, prefix=prefix, module=module)
        (info / "entry_points.txt").write_text(points)
        monkeypatch.syspath_prepend(str(folder))

    return write


Greetings = Registry[Callable[[], str]]


def test_without_other_packages(registry: Greetings) -> None:
    assert registry.names() == ("plain",)
    assert registry.get("plain", "greeting")() == "plain"
    assert registry.plugin("plain") is None
    assert registry.plugin("hello") is None
    assert registry.versions(["plain", "hello"]) == {}


def test_an_unknown_name_lists_the_known_ones(registry: Greetings, install: Install) -> None:
    install("greetings_a", "a_")
    with pytest.raises(InvalidInput, match="unknown greeting; known: plain, a_absent, a_hello"):
        registry.get("bye", "options.greeting")


def test_nothing_is_known(registry: Greetings) -> None:
    empty: Greetings = Registry("greeting", GROUP, {})
    with pytest.raises(InvalidInput, match="unknown greeting; known: none") as caught:
        empty.get("bye", "options.greeting")
    assert (caught.value.field, caught.value.value) == ("options.greeting", "bye")


def test_an_implementation_of_another_package(registry: Greetings, install: Install) -> None:
    install("greetings_b", "b_")
    assert registry.get("b_hello", "greeting")() == "hello"
    plugin = registry.plugin("b_hello")
    assert plugin is not None
    assert (plugin.name, plugin.distribution, plugin.version) == ("b_hello", "greetings_b", "1.2")
    assert plugin.source == "greetings_b:hello of greetings_b 1.2"
    assert registry.plugin("b_hello") is plugin  # loaded once
    assert registry.versions(["plain", "b_hello"]) == {"greetings_b": "1.2"}


def test_implementations_of_this_package_come_first(registry: Greetings, install: Install) -> None:
    install("greetings_c", "c_")
    assert registry.get("plain", "greeting")() == "plain"
    assert registry.names().count("plain") == 1


def test_a_package_installed_later_is_found_after_clearing(
    registry: Greetings, install: Install
) -> None:
    assert registry.names() == ("plain",)
    install("greetings_d", "d_")
    assert registry.names() == ("plain",)
    registry.clear()
    assert "d_hello" in registry.names()


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("number", "the plug-in must be callable, is int"),
        ("absent", "the plug-in cannot be loaded: AttributeError"),
        ("no_module", "the plug-in cannot be loaded: ModuleNotFoundError"),
    ],
)
def test_an_entry_point_that_cannot_be_used(
    registry: Greetings, install: Install, name: str, reason: str
) -> None:
    install("greetings_e", "e_")
    with pytest.raises(InvalidInput, match=reason) as caught:
        registry.get(f"e_{name}", "greeting")
    assert caught.value.field == f"test_greetings.e_{name}"
    assert "greetings_e 1.2" in caught.value.value


def test_one_name_in_two_packages(registry: Greetings, install: Install) -> None:
    for module in ("greetings_f", "greetings_g"):
        install(module, "f_")
    with pytest.raises(InvalidInput, match="two plug-ins have this name") as caught:
        registry.get("f_hello", "greeting")
    assert "greetings_f" in caught.value.value
    assert "greetings_g" in caught.value.value


def test_one_package_found_twice(
    registry: Greetings, install: Install, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """An editable installation may be found by two paths."""
    install("greetings_h", "h_")
    link = tmp_path / "link"
    link.symlink_to(tmp_path / "greetings_h-1.2")
    monkeypatch.syspath_prepend(str(link))
    assert registry.get("h_hello", "greeting")() == "hello"
