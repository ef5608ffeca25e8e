"""Counts and seconds of the expensive operations, for the statistics of a plan."""

from __future__ import annotations

import time
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager

from rbprm_core.failures import Cause

CONTACTS_FOUND = "contacts"
"""Counter of the contacts found for single limbs."""
ROOTS = "roots"
"""Counter of the root configurations tried along the guides."""
ROOTS_IN_EQUILIBRIUM = "roots_in_equilibrium"
"""Counter of those root configurations at which a state was found."""


def no_contact(cause: Cause) -> str:
    """Name of the counter of the contacts that were not found for a cause.

    Args:
        cause: one of `rbprm_core.failures.CONTACT_CAUSES`.
    """
    return f"no_contact.{cause.name.lower()}"


class Counters:
    """Adds up counts and seconds by name. The seconds are reported and decide nothing.

    Attributes:
        counts: number of events by name.
        seconds: seconds by name of the operation.
    """

    def __init__(self) -> None:
        self.counts: defaultdict[str, int] = defaultdict(int)
        self.seconds: defaultdict[str, float] = defaultdict(float)

    @contextmanager
    def timed(self, name: str) -> Iterator[None]:
        """Count one call of an operation and add its time.

        Args:
            name: name of the operation.
        """
        start = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[name] += time.perf_counter() - start
            self.counts[name] += 1
