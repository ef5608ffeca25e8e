"""The names in the launch files and in RViz's configuration exist.

PyPI has neither launch nor RViz (docs/deployment.md): names are searched in the syntax trees of the
files, and functions that do not need launch are called.
"""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

import pytest
import yaml
from ament_index_python import get_package_prefix, get_package_share_directory
from rclpy.qos import DurabilityPolicy, ReliabilityPolicy

from rbprm_core.robot import known_robots
from rbprm_core.scenario import load_scenario
from rbprm_ros.node.parameters import parameter_options

if TYPE_CHECKING:
    from conftest import Executive, Site

PACKAGE = Path(__file__).resolve().parents[3] / "src" / "rbprm_ros"
PLANNER, DEMO = (PACKAGE / "launch" / f"{name}.launch.py" for name in ("planner", "demo"))
SHARE = Path(get_package_share_directory("rbprm_ros"))
EXECUTABLES = Path(get_package_prefix("rbprm_ros")) / "lib" / "rbprm_ros"
NOTHING = {"robot": "", "params_file": "", "autostart": "", "use_sim_time": ""}
LATCHED = ("Transient Local", "Reliable")  # in the words of RViz
FROM_PYPI = {
    "pinocchio",
    "pydantic",
    "rosbags",
    "shapely",
    "scipy",
}  # not packages of ROS (docs/deployment.md)


def tree(file: Path) -> ast.Module:
    """The syntax tree of a file."""
    return ast.parse(file.read_text())


def dictionary(file: Path, name: str) -> dict[str, Any]:
    """A dictionary that a file defines; computed values are None."""
    (found,) = (
        node.value
        for node in tree(file).body
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == name
    )
    assert isinstance(found, ast.Dict)
    pairs = zip(found.keys, found.values, strict=True)
    return {constant(key): constant(value) for key, value in pairs if key}


def constant(node: ast.expr) -> Any:
    try:
        return ast.literal_eval(node)
    except ValueError:
        return None


def keywords(file: Path, name: str) -> Iterator[Any]:
    """The constants that calls in a file pass for a keyword."""
    for node in ast.walk(tree(file)):
        if isinstance(node, ast.keyword) and node.arg == name:
            yield constant(node.value)


def functions(*names: str) -> dict[str, Callable[..., Any]]:
    """Functions of the planner's launch file, compiled without launch."""
    body = [n for n in tree(PLANNER).body if isinstance(n, ast.FunctionDef) and n.name in names]
    made: dict[str, Any] = {"Path": Path, "CONFIG": SHARE / "config", "NAME": "rbprm_planner"}
    exec(compile(ast.Module(body, []), PLANNER, "exec"), made)
    return {name: made[name] for name in names}


@pytest.mark.parametrize("file", [PLANNER, DEMO], ids=lambda file: file.name)
def test_launch_files_start_what_is_installed(file: Path) -> None:
    compile(file.read_text(), file, "exec")
    assert (SHARE / "launch" / file.name).read_text() == file.read_text()
    started = set(keywords(file, "executable")) - {"rviz2"}
    assert started
    assert started <= {path.name for path in EXECUTABLES.iterdir()}


def test_demo_walks_a_scenario_that_is_there_with_its_robot() -> None:
    defaults = dictionary(DEMO, "ARGUMENTS")
    assert load_scenario(defaults["scenario"][0]).robot == defaults["robot"][0]
    text = DEMO.read_text()
    assert (DEMO.parent / re.findall(r'"(\S+\.launch\.py)"', text)[0]) == PLANNER
    declared = "".join(path.read_text() for path in (PACKAGE / "rbprm_ros").rglob("*.py"))
    for name in ("planner", "scenario"):
        assert f'"{name}"' in text
        assert f'declare_parameter("{name}"' in declared


@pytest.mark.parametrize("robot", ["", *known_robots(), "own/robot.toml"])
def test_robot_has_its_file_where_there_is_one(robot: str) -> None:
    found = functions("parameters")["parameters"](NOTHING | {"robot": robot})
    file = SHARE / "config" / f"{robot or 'hyq'}.yaml"
    own = [{"robot": robot}] if robot else []
    assert found == ([str(file)] if file.is_file() else []) + own


def test_arguments_take_the_place_of_what_the_file_says() -> None:
    parameters = functions("parameters")["parameters"]
    assert parameters(NOTHING | {"params_file": "mine.yaml"}) == ["mine.yaml"]
    given = {
        "robot": "g1",
        "params_file": "mine.yaml",
        "autostart": "false",
        "use_sim_time": "true",
    }
    own = {"robot": "g1", "autostart": False, "use_sim_time": True}
    assert parameters(given) == ["mine.yaml", own]
    assert own.keys() - {"use_sim_time"} <= {option.name for option in parameter_options()}
    assert {*dictionary(PLANNER, "ARGUMENTS"), *dictionary(PLANNER, "CHOICES")} > given.keys()


def test_log_level_reaches_the_node_in_a_namespace(site: Site) -> None:
    names = [functions("logger")["logger"](namespace) for namespace in ("", "robot1", "a/b")]
    assert names == ["rbprm_planner", "robot1.rbprm_planner", "a.b.rbprm_planner"]
    level = ("--log-level", f"{names[1]}:=debug")
    planner = site.start("planner_node", "--ros-args", "-r", "__ns:=/robot1", *level)
    site.start(
        "publish_surfaces", "flat", "--ros-args", "-p", "topic:=/robot1/rbprm_planner/surfaces"
    )
    planner.wait_for("[DEBUG]")
    planner.wait_for("surfaces 1:")


def test_rviz_shows_what_the_planner_publishes(site: Site) -> None:
    file = SHARE / "config" / "planner.rviz"
    manager = yaml.safe_load(file.read_text())["Visualization Manager"]
    frame = {option.name: option.default for option in parameter_options()}["planning_frame"]
    assert manager["Global Options"]["Fixed Frame"] == frame
    site.start("planner_node")
    executive = site.executive()
    executive.wait_for_planner()
    kinds = {"MarkerArray": "visualization_msgs/msg/MarkerArray", "Path": "nav_msgs/msg/Path"}
    shown = {d["Class"].rpartition("/")[2]: d["Topic"] for d in manager["Displays"] if "Topic" in d}
    assert shown.keys() == kinds.keys()
    for kind, topic in shown.items():
        (publisher,) = publishers(executive, topic["Value"])
        assert publisher.topic_type == kinds[kind]
        # RViz must request what the planner offers, or it gets no latched messages.
        offered = publisher.qos_profile
        assert (topic["Durability Policy"], topic["Reliability Policy"]) == LATCHED
        assert (offered.durability, offered.reliability) == (
            DurabilityPolicy.TRANSIENT_LOCAL,
            ReliabilityPolicy.RELIABLE,
        )
        assert topic["Value"] in PLANNER.read_text().replace("{NAME}", "rbprm_planner")


def publishers(executive: Executive, topic: str) -> list[Any]:
    """The publishers of a topic, as soon as there are some."""
    look = executive.node.get_publishers_info_by_topic
    executive.spin_until(lambda: len(look(topic)) > 0, f"publisher of {topic}")
    return list(look(topic))


def test_package_names_what_it_imports() -> None:
    root = ElementTree.parse(PACKAGE / "package.xml").getroot()
    named = {str(entry.text) for entry in root.iter("exec_depend")}
    imported = {
        name.partition(".")[0]
        for file in (*(PACKAGE / "rbprm_ros").rglob("*.py"), PLANNER, DEMO)
        for node in ast.walk(tree(file))
        if isinstance(node, ast.Import | ast.ImportFrom)
        for name in ([node.module or ""] if isinstance(node, ast.ImportFrom) else names_of(node))
    }
    needed = imported - sys.stdlib_module_names - FROM_PYPI - {"rbprm_ros", "numpy"}
    assert needed | {"python3-numpy"} <= named


def names_of(node: ast.Import) -> list[str]:
    """The modules of an import statement."""
    return [alias.name for alias in node.names]
