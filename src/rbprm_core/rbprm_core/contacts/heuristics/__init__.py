"""Heuristics that rank contact candidates, by name; one file each (Tonneau et al. 2018, 5.2)."""

from rbprm_core.contacts.heuristics.candidates import Candidates
from rbprm_core.contacts.heuristics.registry import (
    BUILTIN,
    HEURISTICS,
    Heuristic,
    check_names,
    rank,
)

__all__ = ["BUILTIN", "HEURISTICS", "Candidates", "Heuristic", "check_names", "rank"]
