"""Messages of diagnostics, and the list of robots."""

from __future__ import annotations

import dataclasses

import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.serialization import serialize_message
from std_msgs.msg import Header

from rbprm_core.errors import InvalidInput
from rbprm_core.robot import known_robots
from rbprm_ros.conversions.diagnostics import LONG_QUEUE, Health, diagnostics_message
from rbprm_ros.conversions.robots import robot_messages

WELL = Health(
    worker_alive=True,
    restarts=0,
    environment_version=3,
    environment_age=0.25,
    rejection="",
    planning_time=1.5,
    queue=1,
)
OK, WARN, ERROR = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR


@pytest.mark.parametrize(
    ("changes", "levels"),
    [
        ({}, (OK, OK, OK)),
        ({"worker_alive": False}, (ERROR, OK, OK)),
        ({"restarts": 2}, (WARN, OK, OK)),
        ({"environment_version": 0, "environment_age": None}, (OK, WARN, OK)),
        ({"rejection": "surfaces.0.id: must not be empty"}, (OK, ERROR, OK)),
        ({"queue": LONG_QUEUE + 1, "planning_time": None}, (OK, OK, WARN)),
    ],
)
def test_levels(changes: dict[str, object], levels: tuple[bytes, ...]) -> None:
    health = dataclasses.replace(WELL, **changes)  # type: ignore[arg-type]
    message = diagnostics_message(health, Header(), "rbprm_planner")
    assert tuple(status.level for status in message.status) == levels
    serialize_message(message)


def test_values() -> None:
    message = diagnostics_message(WELL, Header(), "rbprm_planner")
    assert [s.name for s in message.status] == [
        "rbprm_planner: planning process",
        "rbprm_planner: environment",
        "rbprm_planner: queue",
    ]
    values = {pair.key: pair.value for status in message.status for pair in status.values}
    assert values == {
        "restarts": "0",
        "last planning time [s]": "1.500",
        "version": "3",
        "age [s]": "0.250",
        "length": "1",
    }


def test_known_robots() -> None:
    robots = {robot.name: robot for robot in robot_messages("hyq")}
    assert list(robots) == sorted(known_robots())
    assert robots["talos"].default_limbs == ["left_leg", "right_leg"]
    assert set(robots["talos"].limbs) > set(robots["talos"].default_limbs)
    assert robots["hyq"].default_limbs == robots["hyq"].limbs
    assert robots["hyq"].urdf.endswith(".urdf")
    assert 0.4 < robots["hyq"].reference_height < 0.8
    assert 0.9 < robots["talos"].reference_height < 1.2


def test_robot_of_a_file(quick_hyq: str) -> None:
    messages = robot_messages(quick_hyq)
    by_name = {robot.name: robot for robot in messages}
    assert by_name[quick_hyq].reference_height == by_name["hyq"].reference_height
    with pytest.raises(InvalidInput):
        robot_messages("no_such_robot")
