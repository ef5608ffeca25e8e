"""Conversion between messages and types of the core; the only room that uses both.

Values from outside are validated here or in the core; errors name the field of the message.
"""

from rbprm_ros.conversions.diagnostics import diagnostics_message
from rbprm_ros.conversions.environments import snapshot_update, update_of_setting
from rbprm_ros.conversions.geometry import time_message
from rbprm_ros.conversions.marker_updates import update_of_markers
from rbprm_ros.conversions.markers import markers_message
from rbprm_ros.conversions.plans import (
    guide_message,
    plan_of_messages,
    read_sequence,
    sequence_message,
    statistics_message,
)
from rbprm_ros.conversions.requests import (
    job_of_message,
    replan_job_of_message,
    request_message,
)
from rbprm_ros.conversions.results import result_message, success_message
from rbprm_ros.conversions.robots import robot_messages
from rbprm_ros.conversions.status import invalid_state_messages, status_message
from rbprm_ros.conversions.surfaces import (
    environment_entry,
    environment_message,
    surfaces_message,
    update_of_message,
)

__all__ = [
    "diagnostics_message",
    "environment_entry",
    "environment_message",
    "guide_message",
    "invalid_state_messages",
    "job_of_message",
    "markers_message",
    "plan_of_messages",
    "read_sequence",
    "replan_job_of_message",
    "request_message",
    "result_message",
    "robot_messages",
    "sequence_message",
    "snapshot_update",
    "statistics_message",
    "status_message",
    "success_message",
    "surfaces_message",
    "time_message",
    "update_of_markers",
    "update_of_message",
    "update_of_setting",
]
