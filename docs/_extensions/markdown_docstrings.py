"""Docstrings written in Markdown, as the pages are: code in backticks, formulas in dollars.

Sphinx reads docstrings as reStructuredText: they are translated before napoleon parses their
sections.
"""

from __future__ import annotations

import re
from typing import Any

from sphinx.application import Sphinx
from sphinx.util import logging

logger = logging.getLogger(__name__)

CODE = r"(?<![:`\\])`(?P<code>[^`\n]+)`(?!`)"
MATH = r"(?<![\\$\w])\$(?P<math>[^$\n]+)\$(?![\w$])"
LINK = r"\[(?P<text>[^]\n]+)\]\((?P<url>https?://[^)\s]+)\)"
PLAIN = r"(?P<plain>\||(?<=\w)_(?!\w))"  # marks of reStructuredText that are text in Markdown
INLINE = re.compile(f"{CODE}|{MATH}|{LINK}|{PLAIN}")


def translated(line: str) -> str:
    """A line of Markdown as reStructuredText."""

    def one(match: re.Match[str]) -> str:
        if match["code"]:
            return f"``{match['code']}``"
        if match["math"]:
            return f":math:`{match['math']}`"
        if match["plain"]:
            return f"\\{match['plain']}"
        return f"`{match['text']} <{match['url']}>`__"

    return INLINE.sub(one, line)


def marked(lines: list[str]) -> list[str]:
    """Translated lines, with a directive before each block of code.

    Code is indented in Markdown; what is indented below a section, such as "Args:", is none.
    """
    result: list[str] = []
    section = code = False
    for number, line in enumerate(lines):
        if line and not line.startswith(" "):
            section, code = bool(re.fullmatch(r"\w+:", line)), False
        elif line.startswith("    ") and not section and not code and not lines[number - 1]:
            result += [".. code-block:: python", ""]
            code = True
        result.append(line if code else translated(line))
    return result


def _translate(app: Sphinx, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    if any(re.search(r"[\x00-\x08\x0b-\x1f]", line) for line in lines):
        logger.warning("%s: a formula loses its backslashes; write r-strings", name)
    lines[:] = marked(lines)
    # Napoleon takes what precedes a colon in "Returns:" for the type; the first colon ends it.
    for number, line in enumerate(lines[1:], 1):
        if lines[number - 1].strip() in ("Returns:", "Yields:"):
            lines[number] = re.sub(r"^(\s*)", r"\1: ", line)


def _escape_types(
    app: Sphinx, what: str, name: str, obj: Any, options: Any, lines: list[str]
) -> None:
    """Escape the types that napoleon adds to attributes, such as np.int_."""
    for number, line in enumerate(lines):
        if line.startswith(":vartype"):
            lines[number] = re.sub(r"(?<=\w)_(?!\w)", r"\\_", line)


def without_annotations(text: str) -> str:
    """A signature with the types alone where they are annotated with ranges."""
    while (start := text.find("Annotated[")) >= 0:
        depth = comma = end = 0
        for end in range(start + len("Annotated"), len(text)):
            depth += (text[end] in "[(") - (text[end] in "])")
            if depth == 1 and text[end] == "," and not comma:
                comma = end
            if depth == 0:
                break
        text = text[:start] + text[start + len("Annotated[") : comma] + text[end + 1 :]
    return text


def _readable_types(
    app: Sphinx,
    what: str,
    name: str,
    obj: Any,
    options: Any,
    arguments: str | None,
    result: str | None,
) -> tuple[str | None, str | None]:
    """Write type aliases by their names (Sphinx 9 shows its placeholder in unions), plain types."""
    named = [
        text and without_annotations(re.sub(r"TypeAliasForwardRef\('(\w+)'\)", r"\1", text))
        for text in (arguments, result)
    ]
    return named[0], named[1]


def setup(app: Sphinx) -> dict[str, bool]:
    app.connect("autodoc-process-docstring", _translate, priority=400)  # napoleon: 500
    app.connect("autodoc-process-docstring", _escape_types, priority=600)
    app.connect("autodoc-process-signature", _readable_types)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
