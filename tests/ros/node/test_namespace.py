"""A planner in a namespace, as for several robots in one ROS domain."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from ament_index_python import get_package_share_directory
from rbprm_msgs.srv import ListRobots

if TYPE_CHECKING:
    from conftest import Site

CONFIG = Path(get_package_share_directory("rbprm_ros")) / "config"
NAMED = {
    "namespace": ("/robot1/rbprm_planner", ("-r", "__ns:=/robot1")),
    "name": ("/feet", ("-r", "__node:=feet")),
    "both": ("/robot1/feet", ("-r", "__ns:=/robot1", "-r", "__node:=feet")),
}


def start_planner(site: Site, robot: str, *names: str) -> None:
    """Start a planner under other names, with the parameter file of a robot."""
    file = str(CONFIG / f"{robot}.yaml")
    site.start("planner_node", "--ros-args", *names, "--params-file", file)


def default_robot(site: Site, planner: str) -> str:
    """The default robot of a planner."""
    executive = site.executive()
    client = executive.node.create_client(ListRobots, f"{planner}/list_robots")
    executive.spin_until(client.service_is_ready, planner)
    future = client.call_async(ListRobots.Request())
    executive.spin_until(future.done, "an answer")
    robot: str = future.result().default_robot
    return robot


@pytest.mark.parametrize("case", NAMED)
def test_parameter_file_holds_under_any_name(case: str, site: Site) -> None:
    planner, names = NAMED[case]
    start_planner(site, "anymal", *names)
    assert default_robot(site, planner) == "anymal"


def test_two_robots_share_a_domain(site: Site) -> None:
    """Each executive executes plans of its own planner on its own surfaces."""
    robots = {"/robot1": "hyq", "/robot2": "go2"}
    for namespace, robot in robots.items():
        start_planner(site, robot, "-r", f"__ns:={namespace}")
    walking = []
    for namespace in robots:
        named = ("-r", f"__ns:={namespace}", "-p", f"planner:={namespace}/rbprm_planner")
        mission = ("-p", "scenario:=flat", "-p", "edits:=false", "-p", "rate:=50.0")
        walking.append(site.start("executive", "--ros-args", *named, *mission))
    for executive in walking:
        assert executive.popen.wait(240.0) == 0, executive.log.read_text()
    assert [default_robot(site, f"{name}/rbprm_planner") for name in robots] == ["hyq", "go2"]
