"""The rules of imports: rooms import only rooms below them, and no modules import each other.

A room is a package or a single module of `rbprm_core` or of `rbprm_ros`; docs/architecture.md
describes them. Imports for type checkers alone count for the rules that name rooms, not for the
order of rooms.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

SOURCES = Path(__file__).resolve().parents[2] / "src"
FACE = "rbprm_core"  # the package itself

CORE_ROWS = (  # from the ground up; a room may import rooms of the rows before its own
    {"arrays", "cache", "failures", "stages", "surface_kind", "version"},
    {"failure_text"},
    {"errors"},
    {"budget", "counters", "files", "option_names", "registry", "resources", "statics"},
    {"validation", "processes"},
    {"placement", "plan_record", "scene"},
    {"check", "environment", "physics", "robot", "view"},
    {"body"},
    {"posture"},
    {"motion"},
    {"guide"},
    {"contacts"},
    {"outcome", "request"},
    {"calibration", "plan_conversion", "scenario"},
    {"planner", "planning_input"},
    {"portfolio", "replanning"},
    {"api"},
    {FACE},
    {"bench"},
    {"cli"},
)
ROS_ROWS = (
    {"errors", "rclpy_utils", "settings"},
    {"environment"},
    {"workers"},
    {"planning"},
    {"conversions"},
    {"demo", "node"},
    {"client", "bags"},
    {"executables"},
)
ROWS = {"rbprm_core": CORE_ROWS, "rbprm_ros": ROS_ROWS}
TO_COME = {"physics"}  # rooms of the floor plan that do not exist yet
MOVED = {"spinning"}  # modules that only keep an old name importable

NEVER = {  # rooms that a room does not import, for types neither
    "posture": {"motion", "guide", "contacts", "planner"},
    "motion": {"guide", "contacts", "planner"},
    "guide": {"contacts", "planner"},
}
ONLY = {  # the only rooms that a room imports, for types too
    "check": {"arrays", "errors", "plan_record", "resources", "validation"},
    "physics": {"arrays", "errors", "plan_record", "resources", "validation"},
    "view": {"arrays", "errors", "plan_record", "resources", "validation"},
}
ROS_MODULES = {"rclpy", "rbprm_ros", "rbprm_msgs", "ament_index_python"}


@cache
def modules(package: str) -> dict[str, Path]:
    """Files of a package's modules, by the modules' names."""
    root = SOURCES / package
    found = {}
    for path in sorted((root / package).rglob("*.py")):
        parts = path.relative_to(root).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def statements(node: ast.AST, types: bool) -> Iterator[ast.AST]:
    """All nodes of a syntax tree, with or without those for type checkers alone."""
    yield node
    for child in ast.iter_child_nodes(node):
        if types or not (isinstance(child, ast.If) and "TYPE_CHECKING" in ast.unparse(child.test)):
            yield from statements(child, types)


@cache
def imports(package: str, module: str, types: bool = False) -> frozenset[str]:
    """Full names of the modules that a module imports, wherever in its code."""
    known = modules(package)
    path = known[module]
    found: set[str] = set()
    for node in statements(ast.parse(path.read_text()), types):
        if isinstance(node, ast.Import):
            found.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            base = str(node.module)
            for alias in node.names:
                full = f"{base}.{alias.name}"
                found.add(full if full in known else base)
    return frozenset(found - {module})


def room(module: str) -> str:
    """The room of a module; the package's own name for its `__init__`."""
    parts = module.split(".")
    return parts[1] if len(parts) > 1 else parts[0]


def rooms(package: str, types: bool = False) -> dict[str, set[str]]:
    """The rooms of a package, and the other rooms that each imports."""
    found: dict[str, set[str]] = {}
    for module in modules(package):
        used = {
            room(name)
            for name in imports(package, module, types)
            if name.split(".")[0] == package and room(name) != room(module)
        }
        found.setdefault(room(module), set()).update(used)
    return found


@pytest.mark.parametrize("package", ROWS)
def test_no_circle_of_modules(package: str) -> None:
    known = modules(package)
    graph = {module: imports(package, module) & known.keys() for module in known}
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        pytest.fail("imports in a circle: " + " <- ".join(error.args[1]))


@pytest.mark.parametrize("package", ROWS)
def test_every_room_has_its_row(package: str) -> None:
    """A new room is entered in the rows of this file and in docs/architecture.md."""
    rows = [name for row in ROWS[package] for name in row]
    assert len(rows) == len(set(rows))
    existing = rooms(package).keys() - MOVED - {"rbprm_ros"}
    assert existing == set(rows) - TO_COME


@pytest.mark.parametrize("package", ROWS)
def test_rooms_import_only_rooms_below(package: str) -> None:
    level = {name: k for k, row in enumerate(ROWS[package]) for name in row}
    upwards = [
        f"{name} imports {other}"
        for name, used in rooms(package).items()
        for other in used
        if name in level and level[other] >= level[name]
    ]
    assert not upwards


def test_rooms_never_import_what_stands_above_by_purpose() -> None:
    found = rooms("rbprm_core", types=True)
    for name, forbidden in NEVER.items():
        assert not found[name] & forbidden, f"{name} imports {found[name] & forbidden}"
    for name, allowed in ONLY.items():
        used = found.get(name, set())
        assert used <= allowed, f"{name} imports {used - allowed}"


def test_the_core_knows_nothing_of_ros() -> None:
    for module in modules("rbprm_core"):
        used = {name.split(".")[0] for name in imports("rbprm_core", module, types=True)}
        assert not used & ROS_MODULES, f"{module} imports {used & ROS_MODULES}"


def test_the_node_imports_the_core_and_not_what_serves_it_on_the_command_line() -> None:
    for module in modules("rbprm_ros"):
        used = {
            room(name)
            for name in imports("rbprm_ros", module, types=True)
            if name.split(".")[0] == "rbprm_core"
        }
        assert not used & {"cli", "bench"}, f"{module} imports {used & {'cli', 'bench'}}"
