"""The directive `interface`: a message, service or action of msg_defs as tables.

    ```{interface} msg/Contact.msg
    ```

Text and tables come from the comments of the file; a field without a comment is a warning.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from docutils import nodes
from docutils.statemachine import StringList
from sphinx.application import Sphinx
from sphinx.util import logging
from sphinx.util.docutils import SphinxDirective

logger = logging.getLogger(__name__)

FOLDER = Path(__file__).resolve().parents[2] / "msg_defs" / "rbprm_msgs"
PARTS = {
    ".msg": ("",),
    ".srv": ("Request", "Response"),
    ".action": ("Goal", "Result", "Feedback"),
}
FIELD = re.compile(
    r"(?P<type>[\w/]+(?:\[[<=\d]*\])?)\s+(?P<name>\w+)\s*(?P<value>=?\s*[^#]*?)\s*(?:#\s*(?P<text>.*))?"
)


@dataclass
class Field:
    """A field or a constant."""

    type: str
    name: str
    value: str
    text: str


@dataclass
class Entry:
    """Fields or constants that share a comment, and the comment."""

    text: str
    fields: list[Field]


def parsed(part: str) -> tuple[str, list[Entry]]:
    """Introduction of a part of an interface file, and its fields."""
    intro, entries = "", list[Entry]()
    for number, block in enumerate(re.split(r"\n\s*\n", part.strip())):
        comments: list[str] = []
        fields: list[Field] = []
        for line in block.splitlines():
            if line.startswith("#"):
                if fields:  # a heading among constants
                    entries.append(Entry(" ".join(comments), fields))
                    comments, fields = [], []
                comments.append(line.lstrip("# "))
            elif line.lstrip().startswith("#"):  # the comment beside a field goes on
                fields[-1].text += f" {line.lstrip(' #')}"
            elif found := FIELD.fullmatch(line):
                fields.append(Field(**{key: text or "" for key, text in found.groupdict().items()}))
        if fields or number > 0:
            entries.append(Entry(" ".join(comments), fields))
        else:
            intro = " ".join(comments)
    return intro, entries


def rows(entries: list[Entry]) -> Iterator[str]:
    """The rows of a table in Markdown."""

    def row(*cells: str) -> str:
        return "".join(f"| {cell.replace('|', chr(92) + '|')} " for cell in cells) + "|"

    for entry in entries:
        constants = [found for found in entry.fields if found.value.startswith("=")]
        fields = [found for found in entry.fields if not found.value.startswith("=")]
        if constants:
            yield row("", "", entry.text)
        for found in constants:
            yield row(f"`{found.name} = {found.value[1:].strip()}`", f"`{found.type}`", found.text)
        if len(fields) > 1 and all(found.text for found in fields):
            yield row("", "", entry.text)
            groups = [([found], found.text) for found in fields]
        else:
            groups = [(fields, " ".join([entry.text, *(found.text for found in fields)]))]
        for group, text in groups if fields else ():
            names = ", ".join(f"`{found.name}`" for found in group)
            types = ", ".join(dict.fromkeys(f"`{found.type}`" for found in group))
            default = f" Default {group[0].value}." if group[0].value else ""
            yield row(names, types, text.strip() + default)


class Interface(SphinxDirective):
    """The directive itself."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        path = FOLDER / self.arguments[0]
        self.env.note_dependency(str(path))
        text: list[str] = []
        parts = path.read_text().split("\n---")
        for title, part in zip(PARTS[path.suffix], parts, strict=True):
            intro, entries = parsed(part)
            for entry in entries:
                for found in entry.fields:
                    if not entry.text and not found.text:
                        logger.warning("%s: no comment on %s", path.name, found.name)
            text += [f"**{title}**" if title else "", "", intro, ""]
            if entries:
                text += ["| field | type | meaning |", "|---|---|---|", *rows(entries), ""]
        node = nodes.section()
        self.state.nested_parse(StringList(text, str(path)), self.content_offset, node)
        return node.children


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_directive("interface", Interface)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
