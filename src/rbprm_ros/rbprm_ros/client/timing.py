"""Periods and timeouts of the client."""

PERIOD = 0.05  # seconds between two checks of a condition that no callback reports
ANSWER_TIMEOUT = 10.0  # seconds; calls that plan nothing are answered in milliseconds
PROBE_PERIOD = 1.0  # seconds until a probe without an answer is sent again
