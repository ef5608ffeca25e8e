"""Draw the rooms of rbprm_core by what they import: docs/architecture.svg.

A room is a package or a single module of rbprm_core. It stands one row above the highest room that
it imports, so that imports only go down.

    .venv/bin/python scripts/draw_architecture.py
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from graphlib import TopologicalSorter
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "src" / "rbprm_core" / "rbprm_core"
FILE = ROOT / "docs" / "architecture.svg"

BOX, GAP, HEIGHT, ROW, MARGIN = 130, 12, 34, 52, 14  # pixels
STYLE = (
    "text{font:14px sans-serif;text-anchor:middle;fill:#17212b}"
    ".package{fill:#cfe3f5;stroke:#4a7ba6}"
    ".module{fill:#f2f2f2;stroke:#8a8a8a}"
    ".sheet{fill:#ffffff}"
)


def rooms() -> dict[str, set[str]]:
    """Rooms of rbprm_core and the rooms that each imports."""
    found: dict[str, set[str]] = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        room = path.relative_to(PACKAGE).with_suffix("").parts[0]
        if room != "__init__":
            found.setdefault(room, set()).update(imported(path) - {room})
    return {room: used & found.keys() for room, used in found.items()}


def imported(path: Path) -> set[str]:
    """Rooms of rbprm_core that a module imports when it runs."""
    found: set[str] = set()
    for node in run(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.module == PACKAGE.name:
            found.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            found.update(str(node.module).split(".")[1:2] if is_own(str(node.module)) else ())
        elif isinstance(node, ast.Import):
            found.update(a.name.split(".")[1] for a in node.names if is_own(a.name))
    return found


def run(node: ast.AST) -> Iterator[ast.AST]:
    """All nodes of a module but those for type checkers alone."""
    yield node
    for child in ast.iter_child_nodes(node):
        if not (isinstance(child, ast.If) and ast.unparse(child.test) == "TYPE_CHECKING"):
            yield from run(child)


def is_own(module: str) -> bool:
    return module.startswith(f"{PACKAGE.name}.")


def rows(uses: dict[str, set[str]]) -> list[list[str]]:
    """Rooms by row, from the top; within a row by name.

    Raises:
        graphlib.CycleError: rooms that import each other.
    """
    level: dict[str, int] = {}
    for room in TopologicalSorter(uses).static_order():
        level[room] = 1 + max((level[other] for other in uses[room]), default=-1)
    highest = max(level.values())
    return [sorted(room for room in uses if level[room] == k) for k in range(highest, -1, -1)]


def drawing() -> str:
    """The text of the SVG file."""
    levels = rows(rooms())
    width = max(map(len, levels)) * (BOX + GAP) - GAP + 2 * MARGIN
    height = len(levels) * ROW - (ROW - HEIGHT) + 2 * MARGIN
    size = f'width="{width}" height="{height}" viewBox="0 0 {width} {height}"'
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" {size}>',
        f"<style>{STYLE}</style>",
        f'<rect class="sheet" width="{width}" height="{height}"/>',
    ]
    for k, names in enumerate(levels):
        left = (width - len(names) * (BOX + GAP) + GAP) / 2
        top = MARGIN + k * ROW
        for i, name in enumerate(names):
            x = left + i * (BOX + GAP)
            kind = "package" if (PACKAGE / name).is_dir() else "module"
            lines.append(
                f'<rect class="{kind}" x="{x:g}" y="{top}" width="{BOX}" height="{HEIGHT}" rx="5"/>'
            )
            lines.append(f'<text x="{x + BOX / 2:g}" y="{top + 22}">{name}</text>')
    return "\n".join([*lines, "</svg>\n"])


if __name__ == "__main__":
    FILE.write_text(drawing())
    print(FILE.relative_to(ROOT))
