"""The commented parameter files: equal to the options, and accepted by the node."""

from __future__ import annotations

import runpy
from collections.abc import Callable
from pathlib import Path

import pytest
from ament_index_python import get_package_share_directory
from rcl_interfaces.srv import GetParameters
from tests.ros.conftest import NODE, Site

SCRIPT = Path(__file__).resolve().parents[3] / "scripts" / "write_parameters.py"
INSTALLED = Path(get_package_share_directory("rbprm_ros")) / "config"
ROBOTS = ("allegro", "anymal", "g1", "go2", "hyq", "talos")


@pytest.fixture(scope="module")
def text_of() -> Callable[[str], str]:
    """A function that returns the text of a robot's file."""
    made: Callable[[str], str] = runpy.run_path(str(SCRIPT))["text_of"]
    return made


@pytest.mark.parametrize("robot", ROBOTS)
def test_the_file_is_what_the_options_give(robot: str, text_of: Callable[[str], str]) -> None:
    text = (INSTALLED / f"{robot}.yaml").read_text()
    assert text == text_of(robot), "run scripts/write_parameters.py"


def test_the_node_takes_a_file(site: Site) -> None:
    site.start("planner_node", "--ros-args", "--params-file", str(INSTALLED / "anymal.yaml"))
    executive = site.executive()
    client = executive.node.create_client(GetParameters, f"{NODE}/get_parameters")
    executive.reach(client, client.service_is_ready, "the parameter service")
    future = client.call_async(GetParameters.Request(names=["robot", "robustness_threshold"]))
    executive.spin_until(future.done, "an answer")
    robot, threshold = future.result().values
    assert (robot.string_value, threshold.double_value) == ("anymal", 3.5)
