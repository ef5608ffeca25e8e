"""What the documents name exists: files, modules, commands, options, messages, links, papers."""

from __future__ import annotations

import ast
import re
import runpy
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from rbprm_core.cli.main import cli
from rbprm_core.errors import ErrorCode
from rbprm_core.robot import known_robots
from rbprm_core.scenario import known_scenarios

ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted((ROOT / "docs").glob("*.md"))
DOCUMENTS = [*PAGES, ROOT / "README.md", ROOT / "CONTRIBUTING.md"]
SOURCES = {name: ROOT / "src" / name / name for name in ("rbprm_core", "rbprm_ros")}
INTERFACES = ROOT / "msg_defs" / "rbprm_msgs"
COMMANDS = cli.commands
OPTIONS = {
    option for command in COMMANDS.values() for entry in command.params for option in entry.opts
}

FOLDERS = "src|docs|tests|scripts|examples|docker|msg_defs|requirements"
MADE = ("docs/_build", "docs/api")  # by make, not in the repository
OTHERS = {  # options of other programs that the pages name
    "--format", "--help", "--ipc", "--localhost", "--network", "--runtime", "--ulimit",
    "--isolation", "--enclave", "--params-file", "--ros-args", "--version",
}  # fmt: skip

NOT_OPTIONS = {"sequence.collision", "sequence.missing_goal_limbs"}  # a time, a message's field

parametrized = pytest.mark.parametrize("page", DOCUMENTS, ids=lambda page: page.name)


def prose(page: Path) -> str:
    """A page without its blocks of code."""
    return re.sub(r"^```.*?^```$", "", page.read_text(), flags=re.DOTALL | re.MULTILINE)


def blocks(page: Path, language: str) -> list[str]:
    """The blocks of code of a page in a language."""
    return re.findall(rf"^```{language}\n(.*?)^```$", page.read_text(), re.DOTALL | re.MULTILINE)


def slug(heading: str) -> str:
    """The anchor of a heading."""
    return re.sub(r"[^\w\- ]", "", heading.strip().lower()).replace(" ", "-")


@cache
def names_of(path: Path) -> frozenset[str]:
    """The names that a module defines or imports at its top level."""
    found: set[str] = set()
    for node in ast.parse(path.read_text()).body:
        if isinstance(node, ast.ClassDef | ast.FunctionDef):
            found.add(node.name)
        elif isinstance(node, ast.Import | ast.ImportFrom):
            found.update(alias.asname or alias.name for alias in node.names)
        elif isinstance(node, ast.Assign):
            found.update(target.id for target in node.targets if isinstance(target, ast.Name))
        elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            found.add(node.target.id)
    return frozenset(found)


def exists(dotted: str) -> bool:
    """True where a dotted name is a package, a module or a name at the top level of one."""
    root, *parts = dotted.split(".")
    path = SOURCES[root]
    while parts and (path / parts[0]).is_dir():
        path /= parts.pop(0)
    if parts and (path / f"{parts[0]}.py").is_file():
        path /= f"{parts.pop(0)}.py"
    module = path / "__init__.py" if path.is_dir() else path
    return not parts or parts[0] in names_of(module)


def calls(page: Path) -> Iterator[tuple[str, list[str]]]:
    """The calls of `rbprm` on a page: command and arguments."""
    found = re.findall(r"(?:\brbprm|\.venv/bin/rbprm) ([a-z]+(?:-[a-z]+)*)\b([^\n`#]*)", code(page))
    for command, rest in found:
        yield command, re.split(r"[\s\[\]=]+", rest.strip())


def code(page: Path) -> str:
    """Everything on a page that is set as code, one piece a line."""
    text = page.read_text()
    fenced = re.findall(r"^```\w*\n(.*?)^```$", text, re.DOTALL | re.MULTILINE)
    indented = re.findall(r"^    .*$", prose(page), re.MULTILINE)
    inline = [piece.replace("\n", " ") for piece in re.findall(r"`([^`]+)`", prose(page))]
    return "\n".join([*fenced, *indented, *inline])


@parametrized
def test_files_that_are_named_exist(page: Path) -> None:
    named = re.findall(rf"(?<![\w/.-])(?:{FOLDERS})/[\w./-]*\w", page.read_text())
    assert [
        name for name in named if not name.startswith(MADE) and not (ROOT / name).exists()
    ] == []
    configs = re.findall(r"(?<![\w/])config/([\w.]+)", page.read_text())
    folder = ROOT / "src" / "rbprm_ros" / "config"
    assert [name for name in configs if name != "ROBOT.yaml" and not (folder / name).exists()] == []


@parametrized
def test_modules_and_names_that_are_named_exist(page: Path) -> None:
    text = re.sub(rf"(?:{FOLDERS})/[\w./-]*", "", page.read_text())
    named = set(re.findall(r"\b(?:rbprm_core|rbprm_ros)(?:\.\w+)+", text))
    assert {name for name in named if not exists(name)} == set()


@parametrized
def test_python_on_the_pages_imports_what_exists(page: Path) -> None:
    for block in blocks(page, "python"):
        for node in ast.walk(ast.parse(block)):
            if isinstance(node, ast.ImportFrom) and str(node.module).split(".")[0] in SOURCES:
                for alias in node.names:
                    assert exists(f"{node.module}.{alias.name}"), ast.unparse(node)


@parametrized
def test_commands_and_their_options_exist(page: Path) -> None:
    for name, arguments in calls(page):
        assert name in COMMANDS, name
        options = {option for entry in COMMANDS[name].params for option in entry.opts}
        named = {word for word in arguments if word.startswith("-")}
        assert named <= options | OTHERS, f"rbprm {name}: {named - options}"
        if name == "plan":
            scenario = arguments[0]
            known = scenario in known_scenarios() or scenario.endswith((".toml", ".json"))
            assert known or not scenario or scenario.startswith("-") or scenario.isupper()


@parametrized
def test_options_named_alone_exist(page: Path) -> None:
    named = set(re.findall(r"`(--[\w-]+)", prose(page)))
    assert named <= OPTIONS | OTHERS


@parametrized
def test_targets_of_make_exist(page: Path) -> None:
    targets = set(re.findall(r"^(\w+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    assert set(re.findall(r"^ *make ([a-z]+)", code(page), re.MULTILINE)) <= targets


@parametrized
def test_options_of_the_planner_and_parameters_exist(page: Path) -> None:
    parameters = (ROOT / "src" / "rbprm_ros" / "config" / "hyq.yaml").read_text()
    known = set(re.findall(r"^ +([\w.]+): ", parameters, re.MULTILINE))
    groups = {name.split(".")[0] for name in known if "." in name}
    named = set(re.findall(rf"`((?:{'|'.join(sorted(groups))})\.\w+(?:\.\w+)?)`", prose(page)))
    assert named <= known | NOT_OPTIONS


@parametrized
def test_links_resolve(page: Path) -> None:
    for target in re.findall(r"\]\(([^)\s]+)\)", prose(page)):
        if re.match(r"https?:|mailto:", target):
            continue
        path, _, anchor = target.partition("#")
        linked = (page.parent / path).resolve() if path else page
        assert linked.exists(), target
        if anchor:
            headings = re.findall(r"^#+ (.*)$", prose(linked), re.MULTILINE)
            assert anchor in {slug(heading) for heading in headings}, target


def test_every_page_is_in_the_contents() -> None:
    contents = (ROOT / "docs" / "index.md").read_text().split()
    assert [page.stem for page in PAGES if page.stem not in {"index", *contents}] == []


def test_every_command_and_exit_code_is_described() -> None:
    text = (ROOT / "docs" / "command_line.md").read_text()
    assert [name for name in COMMANDS if f"`rbprm {name}" not in text] == []
    codes = {int(code) for code in re.findall(r"^\| (\d+) \|", text, re.MULTILINE)}
    assert {int(code) for code in ErrorCode} - {ErrorCode.INTERNAL, ErrorCode.CANCELLED} <= codes


def test_every_interface_is_described() -> None:
    text = (ROOT / "docs" / "messages.md").read_text()
    files = {
        f"{path.parent.name}/{path.name}"
        for kind in ("msg", "srv", "action")
        for path in INTERFACES.glob(f"{kind}/*.{kind}")
    }
    assert set(re.findall(r"^```\{interface\} (\S+)$", text, re.MULTILINE)) == files


def test_codes_of_the_node_are_those_of_the_message() -> None:
    message = (INTERFACES / "msg" / "PlanningResult.msg").read_text()
    codes = set(re.findall(r"^int32 (\w+)=(\d+)", message, re.MULTILINE))
    text = (ROOT / "docs" / "node.md").read_text()
    rows = re.findall(r"^\| (\d+) \| `(\w+)` \|", text, re.MULTILINE)
    assert {(name, code) for code, name in rows} == codes


def test_cited_papers_are_in_the_references() -> None:
    references = (ROOT / "docs" / "references.md").read_text()
    cited: dict[str, Path] = {}
    files = [*DOCUMENTS, *INTERFACES.rglob("*.*"), ROOT / "CHANGELOG.md"]
    for folder in ("src", "scripts", "examples"):
        files += [*(ROOT / folder).rglob("*.py"), *(ROOT / folder).rglob("*.toml")]
    citation = (
        r"\b(?:(?:Del|Van) )?[A-ZÀ-Þ][\wÀ-ÿ]+ (?:et al\.|and [A-ZÀ-Þ][\wÀ-ÿ]+)[ \n]+(?:19|20)\d\d\b"
    )
    for path in files:
        for found in re.findall(citation, path.read_text()):
            cited[" ".join(found.split())] = path
    assert {name: path for name, path in cited.items() if f"**{name}.**" not in references} == {}


def test_robots_in_commands_exist() -> None:
    named = {
        robot
        for page in DOCUMENTS
        for robot in re.findall(r"--robot (\w+)(?![\w.])|calibrate (\w+)", code(page))
        for robot in robot
        if robot and not robot.isupper()
    }
    assert named <= {*known_robots()}


def test_every_room_is_described() -> None:
    text = (ROOT / "docs" / "architecture.md").read_text()
    named = set(re.findall(r"`(\w+)`", text))
    for folder in SOURCES.values():
        rooms = {path.parent.name for path in folder.glob("*/__init__.py")}
        assert rooms - named == set()


def test_the_picture_of_the_rooms_is_up_to_date() -> None:
    """`.venv/bin/python scripts/draw_architecture.py` draws it again."""
    drawing = runpy.run_path(str(ROOT / "scripts" / "draw_architecture.py"))["drawing"]()
    assert (ROOT / "docs" / "architecture.svg").read_text() == drawing
