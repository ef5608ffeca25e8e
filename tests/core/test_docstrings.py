"""Public functions and classes document their parameters, one a line.

A function counts as documented when `Args:` (or `Attributes:` of a class) has an entry for each of
its parameters, each on a line of its own. Fields of a data class may be documented by docstrings of
their own. Private names, properties, and commands, whose options have help texts, do not count.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

import rbprm_core

SOURCES = Path(__file__).resolve().parents[2] / "src"
BARS = {"rbprm_core": 0.9, "rbprm_ros": 0.9}  # share of documented functions and classes
NOT_COUNTED = {"overload", "setter", "override", "command", "group"}  # decorators
ENTRY = re.compile(r"\*{0,2}(\w+)(?: \([^)]*\))?: +\S")

Definition = ast.FunctionDef | ast.AsyncFunctionDef


@dataclass(frozen=True)
class Documented:
    """A function or class with parameters.

    Attributes:
        name: module and qualified name.
        missing: parameters without an entry.
    """

    name: str
    missing: tuple[str, ...]


def definitions(package: str) -> list[Documented]:
    """The public functions and classes of a package that have parameters."""
    root = SOURCES / package
    found: list[Documented] = []
    for path in sorted((root / package).rglob("*.py")):
        parts = path.relative_to(root).with_suffix("").parts
        if not any(part.startswith("_") and part != "__init__" for part in parts):
            module = ".".join(part for part in parts if part != "__init__")
            found += members(ast.parse(path.read_text()).body, module)
    return found


def members(body: list[ast.stmt], prefix: str) -> Iterator[Documented]:
    """The public functions and classes among the statements of a module or a class."""
    for node in body:
        if not isinstance(node, Definition | ast.ClassDef) or node.name.startswith("_"):
            continue
        name = f"{prefix}.{node.name}"
        if isinstance(node, ast.ClassDef):
            yield from counted(name, fields(node), class_text(node))
            yield from members(node.body, name)
        elif not decorators(node) & NOT_COUNTED:
            yield from counted(name, parameters(node), ast.get_docstring(node) or "")


def counted(name: str, names: list[str], text: str) -> Iterator[Documented]:
    """One entry for a definition that has parameters, none for one without."""
    if names:
        known = entries(text)
        yield Documented(name, tuple(each for each in names if each not in known))


def parameters(node: Definition) -> list[str]:
    """Names of a function's parameters, without self and cls."""
    arguments = node.args
    every = [*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs]
    names = [argument.arg for argument in every]
    return [name for name in names if name not in ("self", "cls") and not name.startswith("_")]


def fields(node: ast.ClassDef) -> list[str]:
    """Names of what a class is made of: parameters of `__init__`, or fields of a data class.

    Fields with a docstring of their own are left out.
    """
    for member in node.body:
        if isinstance(member, ast.FunctionDef) and member.name == "__init__":
            return parameters(member)
    records = any("Model" in ast.unparse(base) for base in node.bases)
    if "dataclass" not in decorators(node) and not records:
        return []
    names = []
    for member, following in zip(node.body, [*node.body[1:], None], strict=True):
        if not isinstance(member, ast.AnnAssign) or not isinstance(member.target, ast.Name):
            continue
        described = isinstance(following, ast.Expr) and isinstance(following.value, ast.Constant)
        constant = "ClassVar" in ast.unparse(member.annotation)
        if not (described or constant or member.target.id.startswith("_")):
            names.append(member.target.id)
    return names


def class_text(node: ast.ClassDef) -> str:
    """The docstrings of a class and of its `__init__`."""
    made = [m for m in node.body if isinstance(m, ast.FunctionDef) and m.name == "__init__"]
    return "\n\n".join(ast.get_docstring(each) or "" for each in (node, *made))


def decorators(node: Definition | ast.ClassDef) -> set[str]:
    """Names of the decorators of a definition, without modules and arguments."""
    return {ast.unparse(d).split("(")[0].split(".")[-1] for d in node.decorator_list}


def entries(text: str) -> set[str]:
    """Parameters that have an entry of their own under `Args:` or `Attributes:`."""
    found: set[str] = set()
    inside, indent = False, -1
    for line in text.splitlines():
        entry = line.strip()
        if re.fullmatch(r"[A-Z]\w+:", entry):
            inside, indent = entry in ("Args:", "Attributes:"), -1
        elif inside and entry:
            here = len(line) - len(line.lstrip())
            indent = here if indent < 0 else indent
            match = ENTRY.match(entry)
            if here == indent and match:
                found.add(match[1])
    return found


def test_an_entry_is_found_by_its_own_line() -> None:
    text = "First.\n\nArgs:\n    low: (n,) limits. high: more.\n    q (nq): it\n        goes: on.\n"
    assert entries(text) == {"low", "q"}


@pytest.mark.parametrize("package", BARS)
def test_share_of_documented_definitions(package: str, capsys: pytest.CaptureFixture[str]) -> None:
    found = definitions(package)
    bare = [each for each in found if each.missing]
    share = 1.0 - len(bare) / len(found)
    with capsys.disabled():
        print(f"\n{package}: {share:.1%} of {len(found)} public definitions are documented")
    rows = "\n".join(f"{each.name}: {', '.join(each.missing)}" for each in bare)
    assert share >= BARS[package], rows


def test_all_of_the_public_face_is_documented() -> None:
    """Whatever `import rbprm_core` offers, its methods included."""
    named = {
        f"{member.__module__}.{member.__qualname__}"
        for name in getattr(rbprm_core, "__all__", ())
        for member in [getattr(rbprm_core, name)]
        if hasattr(member, "__qualname__")
    }
    bare = [
        each
        for each in definitions("rbprm_core")
        if each.missing and any(f"{each.name}.".startswith(f"{name}.") for name in named)
    ]
    assert not bare
