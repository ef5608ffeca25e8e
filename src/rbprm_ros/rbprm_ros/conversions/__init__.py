"""Messages to core types and back: the only place that knows both.

Values from outside are checked here or in the core; errors name the field as the message has it.
"""

from rbprm_ros.conversions.plans import (
    guide_message,
    plan_of_messages,
    sequence_message,
    statistics_message,
)
from rbprm_ros.conversions.requests import job_of_message, request_message
from rbprm_ros.conversions.results import result_message
from rbprm_ros.conversions.surfaces import surfaces_message, update_of_message

__all__ = [
    "guide_message",
    "job_of_message",
    "plan_of_messages",
    "request_message",
    "result_message",
    "sequence_message",
    "statistics_message",
    "surfaces_message",
    "update_of_message",
]
