"""Campaigns: many seeds of some scenarios, what they took and where they failed.

`run_campaign` gives a `Campaign`; `write_campaign` leaves it as JSON, tables and plots.
"""

from rbprm_core.bench.campaign import Campaign, run_campaign
from rbprm_core.bench.record import Case, Failure, RunRecord
from rbprm_core.bench.report import write_campaign

__all__ = ["Campaign", "Case", "Failure", "RunRecord", "run_campaign", "write_campaign"]
