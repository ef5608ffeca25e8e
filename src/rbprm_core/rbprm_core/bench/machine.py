"""Hardware and software versions of the machine that runs a campaign."""

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
    """The machine on which a campaign was started; the runs on a cluster may be on others.

    Attributes:
        processor: model of the processor.
        cores: number of logical cores that the process may use.
        memory: physical memory, bytes.
        system: name of the operating system.
        python: version of Python.
        versions: version by name of package.
        date: start of the campaign, UTC, ISO 8601.
    """

    processor: str
    cores: int
    memory: int
    system: str
    python: str
    versions: dict[str, str]
    date: str


def this_machine() -> Machine:
    """The machine of this process, with the present date."""
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
    """Model of the processor, which Linux gives only in a file."""
    try:
        found = re.search(r"^model name\s*:\s*(.+)$", Path("/proc/cpuinfo").read_text(), re.M)
    except OSError:
        found = None
    return found[1] if found else platform.processor() or platform.machine()
