"""Where and with what a campaign was run."""

from __future__ import annotations

import os
import platform
import re
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

import joblib

VERSIONED = ("rbprm_core", "pin", "coal", "daqp", "numpy", "scipy", "joblib")


@dataclass(frozen=True)
class Machine:
    """The machine that a campaign was started on; with a cluster, runs may be elsewhere.

    Attributes:
        processor: model. cores: logical ones that the process may use. memory: bytes.
        system: operating system. python: its version. versions: of packages.
        date: when the campaign began, UTC, ISO 8601.
    """

    processor: str
    cores: int
    memory: int
    system: str
    python: str
    versions: dict[str, str]
    date: str


def this_machine() -> Machine:
    """The machine that this runs on, now."""
    return Machine(
        processor=_processor(),
        cores=joblib.cpu_count(),
        memory=os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"),
        system=platform.platform(terse=True),
        python=platform.python_version(),
        versions={name: version(name) for name in VERSIONED},
        date=datetime.now(UTC).isoformat(timespec="seconds"),
    )


def _processor() -> str:
    """Model of the processor; Linux tells it nowhere but in a file."""
    try:
        found = re.search(r"^model name\s*:\s*(.+)$", Path("/proc/cpuinfo").read_text(), re.M)
    except OSError:
        found = None
    return found[1] if found else platform.processor() or platform.machine()
