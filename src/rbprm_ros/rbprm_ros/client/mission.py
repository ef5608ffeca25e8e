"""The mission of the example executive: its parameters, and the request that it makes."""

from __future__ import annotations

from dataclasses import dataclass

from rbprm_msgs.srv import Plan
from rclpy.node import Node

from rbprm_core.errors import InvalidInput
from rbprm_core.request import PlannerOptions
from rbprm_core.scenario import Scenario, TrunkText, load_scenario
from rbprm_core.scene import Classification
from rbprm_core.validation import finite_number
from rbprm_ros.conversions import request_message


@dataclass(frozen=True)
class Mission:
    """What the executive does; its fields are the parameters of the executive's node.

    Attributes:
        scenario: the scenario whose request is planned.
        seed: seed of the planner's random generator.
        planner: name of the planner's node.
        frame: the planner's planning frame.
        surfaces: whether the executive publishes the scenario's environment at the beginning.
        edits: whether it publishes the scenario's edits, each when its share of the states is
            executed.
        rate: executed states per second.
        timeout: longest time to wait for the planner, or to stand still, seconds.
    """

    scenario: Scenario
    seed: int
    planner: str
    frame: str
    surfaces: bool
    edits: bool
    rate: float
    timeout: float

    @classmethod
    def from_parameters(cls, node: Node) -> Mission:
        """Declare the parameters on a node and return the mission that they describe.

        Args:
            node: the executive's node.

        Raises:
            InvalidInput, ParameterException: a parameter that cannot be used.
        """
        seed = node.declare_parameter("seed", 0).value
        if seed < 0:
            raise InvalidInput("seed", seed, "must not be negative")
        rate = finite_number("rate", node.declare_parameter("rate", 5.0).value, low=0.1)
        timeout = finite_number("timeout", node.declare_parameter("timeout", 60.0).value, low=0.0)
        return cls(
            scenario=load_scenario(node.declare_parameter("scenario", "replanning").value),
            seed=seed,
            planner=node.declare_parameter("planner", "/rbprm_planner").value,
            frame=node.declare_parameter("frame_id", "map").value,
            surfaces=node.declare_parameter("surfaces", True).value,
            edits=node.declare_parameter("edits", True).value,
            rate=rate,
            timeout=timeout,
        )

    def request(self) -> Plan.Request:
        """The message that requests the scenario's plan."""
        robot = self.scenario.load_robot()
        time_limit = self.scenario.request_text(robot.name).time_limit
        request = self.scenario.request_for(robot, self.seed)
        message = request_message(request, self.scenario.robot, time_limit, self.frame)
        message.limbs = list(self.scenario.limbs or ())
        message.root_joints = list(self.scenario.root_joints or ())
        return message


def parts_without_message(scenario: Scenario) -> list[str]:
    """The parts of a scenario that influence planning and that no message carries.

    Args:
        scenario: the scenario.
    """
    parts = {
        "[heuristics]": bool(scenario.heuristics),
        "[surfaces]": bool(scenario.surfaces),
        "[trunk]": scenario.trunk != TrunkText(),
        "[options]": scenario.options != PlannerOptions(),
        "[environment.classification]": scenario.environment.classification != Classification(),
    }
    return [name for name, given in parts.items() if given]
