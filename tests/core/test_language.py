"""The language of source, documents and messages: the field's words, and names with min and max.

CONTRIBUTING.md has the rules. These tests find what can be found by a word; the rest is for a
reader.
"""

from __future__ import annotations

import ast
import io
import re
import tokenize
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
THIS = Path(__file__).relative_to(ROOT)

FORBIDDEN = re.compile(r"\b(?:who|whom|nobody|somebody|anybody|told|asked)\b", re.IGNORECASE)
DIALECT = re.compile(r"\b(?:tally|tallies|rehearsal|rehearsals|outbox)\b", re.IGNORECASE)
SUPERLATIVE = re.compile(r"\b(?:\w*_)?(?<!at_)(?:least|most)_\w+")

SUPERLATIVES_ALLOWED = {"least_squares"}  # names of other libraries
OLD_NAMES = {  # files with the old names of options, which are still accepted
    "src/rbprm_core/rbprm_core/cli/plan.py",
    "src/rbprm_core/rbprm_core/option_names.py",
    "src/rbprm_ros/rbprm_ros/node/parameters.py",
}


def files(*patterns: str) -> list[Path]:
    """Files of the repository by patterns, without what `make` makes."""
    found = {path.relative_to(ROOT) for pattern in patterns for path in ROOT.glob(pattern)}
    made = ("docs/_build", "docs/api", "ros2_ws", ".venv")
    return sorted(
        path
        for path in found
        if not str(path).startswith(made) and not any("egg-info" in part for part in path.parts)
    )


PYTHON = files("src/**/*.py", "tests/**/*.py", "scripts/**/*.py", "examples/**/*.py", "docs/*.py")
SHELL = files("scripts/**/*.sh", "docker/**/*", "Makefile", ".ci/run", "requirements/*.txt")
SETTINGS = files("**/pyproject.toml", "src/**/*.toml", "src/**/*.yaml")
INTERFACES = files("msg_defs/**/*.msg", "msg_defs/**/*.srv", "msg_defs/**/*.action")
DOCUMENTS = files("docs/**/*.md", "*.md", "examples/**/*.md", "docker/**/*.md")


@cache
def lines_of(path: Path) -> tuple[tuple[int, str], ...]:
    """The lines of a file that are for a reader: docstrings and comments, or prose."""
    text = (ROOT / path).read_text()
    if path.suffix == ".py":
        return tuple(sorted({*comments(text), *docstrings(text)}))
    if path.suffix == ".md":
        blank = re.sub(r"^( *```).*?^ *```$", keep_lines, text, flags=re.DOTALL | re.MULTILINE)
        return tuple(enumerate(blank.splitlines(), 1))
    lines = list(enumerate(text.splitlines(), 1))
    return tuple((number, line.partition("#")[2]) for number, line in lines if "#" in line)


def keep_lines(block: re.Match[str]) -> str:
    """As many empty lines as a block has."""
    return "\n" * block.group().count("\n")


def comments(text: str) -> Iterator[tuple[int, str]]:
    """The comments of Python code by lines."""
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.COMMENT:
            yield token.start[0], token.string


def docstrings(text: str) -> Iterator[tuple[int, str]]:
    """The lines of all strings that are statements: docstrings of definitions and attributes."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            value = node.value.value
            if isinstance(value, str):
                yield from enumerate(value.splitlines(), node.lineno)


def test_no_forbidden_words() -> None:
    everything = [*PYTHON, *SHELL, *SETTINGS, *INTERFACES, *DOCUMENTS]
    found = [
        f"{path}:{number}: {match.group()}: {line.strip()}"
        for path in everything
        if path != THIS
        for number, line in lines_of(path)
        for match in [FORBIDDEN.search(line) or DIALECT.search(line)]
        if match
    ]
    assert not found, f"{len(found)} lines\n" + "\n".join(found)


def test_names_say_min_and_max() -> None:
    found = []
    for path in [*PYTHON, *INTERFACES, *DOCUMENTS, *SETTINGS]:
        if path.parts[0] == "tests" or str(path) in OLD_NAMES or path.name == "CHANGELOG.md":
            continue
        for number, line in enumerate((ROOT / path).read_text().splitlines(), 1):
            names = {match.group() for match in SUPERLATIVE.finditer(line)}
            found += [f"{path}:{number}: {name}" for name in names - SUPERLATIVES_ALLOWED]
    assert not found, "\n".join(found)
