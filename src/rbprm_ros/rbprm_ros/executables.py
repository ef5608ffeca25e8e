"""Entry points of the executables.

They listen to signals before they import: rclpy and the planner's libraries take seconds to load on
a busy machine, and a container may be stopped right then.
"""

from __future__ import annotations

import sys

from rbprm_ros.rclpy_utils.signals import stop_event


def planner_node() -> None:
    """The planner's node."""
    stop = stop_event()
    from rbprm_ros.node.planner_node import run

    sys.exit(run(stop))


def publish_surfaces() -> None:
    """The stand-in for perception."""
    stop = stop_event()
    from rbprm_ros.demo.publish_surfaces import run

    sys.exit(run(stop, sys.argv))


def record_bag() -> None:
    """The recorder of bags."""
    stop = stop_event()
    from rbprm_ros.bags.record import run

    sys.exit(run(stop, sys.argv))


def play_bag() -> None:
    """The player of bags."""
    stop = stop_event()
    from rbprm_ros.bags.play import run

    sys.exit(run(stop, sys.argv))


def check_health() -> None:
    """The health check of containers."""
    stop = stop_event()
    from rbprm_ros.client.check_health import run

    sys.exit(run(stop))


def executive() -> None:
    """The mission executive."""
    stop = stop_event()
    from rbprm_ros.client.executive import run

    sys.exit(run(stop))
