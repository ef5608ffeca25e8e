"""Benchmark campaigns: scenarios planned with many seeds, with times, success rates and failures.

`run_campaign` returns a `Campaign`; `write_campaign` writes it as JSON, tables and plots.
"""

from rbprm_core.bench.campaign import Campaign, run_campaign
from rbprm_core.bench.record import Case, RunFailure, RunRecord
from rbprm_core.bench.report import write_campaign

__all__ = ["Campaign", "Case", "RunFailure", "RunRecord", "run_campaign", "write_campaign"]
