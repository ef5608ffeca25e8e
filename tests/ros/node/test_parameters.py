"""Parameters of the node: old names, choices and contradictory values."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import pytest
import rclpy
from rcl_interfaces.srv import DescribeParameters, SetParameters
from rclpy.context import Context
from rclpy.node import Node
from rclpy.parameter import Parameter

from rbprm_core.errors import InvalidInput
from rbprm_ros.node.parameters import RENAMED_PARAMETERS, Parameters, parameter_options

if TYPE_CHECKING:
    from conftest import Executive, Site

OLD_VALUES = {
    "generator.most_robust": True,
    "shortcuts": 7,
    "settle": False,
    "guide.planner": "prm",
    "sequence.least_step": 0.05,
    "classification.least_area": 0.01,
    "replanning.most_restarts": 9,
}


@pytest.fixture
def context() -> Iterator[Context]:
    made = Context()
    rclpy.init(context=made)
    yield made
    made.try_shutdown()


def parameters(context: Context, **overrides: Any) -> tuple[Node, Parameters]:
    """Parameters of a node with overrides."""
    given = [Parameter(name, value=value) for name, value in overrides.items()]
    node = Node("planner", context=context, parameter_overrides=given)
    return node, Parameters(node)


def test_every_old_name_has_a_new_one() -> None:
    names = {option.name for option in parameter_options()}
    assert set(RENAMED_PARAMETERS) == set(OLD_VALUES)
    assert set(RENAMED_PARAMETERS.values()) <= names
    assert not set(RENAMED_PARAMETERS) & names


@pytest.mark.parametrize("old", sorted(OLD_VALUES))
def test_an_old_name_is_accepted_at_the_start_and_at_run_time(context: Context, old: str) -> None:
    new, value = RENAMED_PARAMETERS[old], OLD_VALUES[old]
    node, _ = parameters(context, **{old: value})
    assert node.get_parameter(new).value == value
    assert not node.has_parameter(old)
    other, _ = parameters(context)
    assert other.get_parameter(new).value != value
    assert other.set_parameters_atomically([Parameter(old, value=value)]).successful
    assert other.get_parameter(new).value == value


def test_the_value_of_an_old_name_is_in_the_settings(context: Context) -> None:
    _, declared = parameters(context, **{"replanning.most_restarts": 9, "guide.planner": "prm"})
    assert declared.settings.replanning.max_restarts == 9
    assert declared.settings.stages.guide == "prm"


def test_old_and_new_name_together_are_refused(context: Context) -> None:
    with pytest.raises(InvalidInput, match=r"sequence\.min_step, which is given too"):
        parameters(context, **{"sequence.least_step": 0.05, "sequence.min_step": 0.05})


def test_contradictory_options_are_refused(context: Context) -> None:
    with pytest.raises(InvalidInput, match=r"sequence\.min_step"):
        parameters(context, **{"sequence.step": 0.1, "sequence.min_step": 0.2})


def test_old_names_through_the_node(site: Site) -> None:
    planner = site.start("planner_node", "--ros-args", "-p", "sequence.least_step:=0.05")
    planner.wait_for("parameter sequence.least_step is now called sequence.min_step")
    executive: Executive = site.executive()
    executive.wait_for_planner()
    change = Parameter("replanning.most_restarts", value=1).to_parameter_msg()
    request = SetParameters.Request(parameters=[change])
    answer = executive.ask(SetParameters, "set_parameters", request)
    assert answer.results[0].successful, answer.results[0].reason
    planner.wait_for("parameter replanning.most_restarts is now called replanning.max_restarts")
    names = ["stages.guide", "stages.contacts", "robot"]
    described = executive.ask(
        DescribeParameters, "describe_parameters", DescribeParameters.Request(names=names)
    )
    choices = [descriptor.additional_constraints for descriptor in described.descriptors]
    assert "rrt, prm" in choices[0]
    assert "along_guide" in choices[1]
    assert "hyq" in choices[2]
