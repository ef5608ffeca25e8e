"""`check_health`: test whether a planner answers; the health check of its container."""

from __future__ import annotations

import sys
import threading

from rbprm_msgs.srv import ListRobots
from rclpy.node import Node

from rbprm_ros.rclpy_utils.qos import CALLS
from rbprm_ros.rclpy_utils.spinning import Spinner, init


def run(stop: threading.Event) -> int:
    """Call the planner's cheapest service.

    Args:
        stop: event that ends the check.

    Returns:
        The exit code; 1 where the answer does not come in time.
    """
    init()
    node = Node("health_check")
    planner = node.declare_parameter("planner", "/rbprm_planner").value
    timeout = node.declare_parameter("timeout", 5.0).value
    client = node.create_client(ListRobots, f"{planner}/list_robots", qos_profile=CALLS)
    spinner = Spinner(node)
    spinner.spin_until(lambda: stop.is_set() or client.service_is_ready(), timeout)
    future = client.call_async(ListRobots.Request())
    spinner.spin_until(lambda: stop.is_set() or future.done(), timeout)
    healthy = future.done()
    print(f"{planner} answers" if healthy else f"no answer of {planner}", file=sys.stderr)
    spinner.close()
    return 0 if healthy else 1
