"""Entry points of the executables.

They handle signals before they import anything else: on a busy machine, rclpy and the planner's
libraries take seconds to load, and a container may be stopped in that time.
"""

from __future__ import annotations

import sys

from rbprm_ros.rclpy_utils.signals import stop_event


def planner_node() -> None:
    """Run the planner's node."""
    stop = stop_event()
    from rbprm_ros.node.planner_node import run

    sys.exit(run(stop))


def publish_surfaces() -> None:
    """Run the stand-in for perception."""
    stop = stop_event()
    from rbprm_ros.demo.publish_surfaces import run

    sys.exit(run(stop, sys.argv))


def record_bag() -> None:
    """Record a bag."""
    stop = stop_event()
    from rbprm_ros.bags.record import run

    sys.exit(run(stop, sys.argv))


def play_bag() -> None:
    """Play a bag."""
    stop = stop_event()
    from rbprm_ros.bags.play import run

    sys.exit(run(stop, sys.argv))


def check_health() -> None:
    """Check the health of a planner, for containers."""
    stop = stop_event()
    from rbprm_ros.client.check_health import run

    sys.exit(run(stop))


def executive() -> None:
    """Run the mission executive."""
    stop = stop_event()
    from rbprm_ros.client.executive import run

    sys.exit(run(stop))
