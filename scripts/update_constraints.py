"""Resolve requirements/*.txt again and write requirements/constraints.txt.

Run it with each supported Python; the second run adds the packages that only that one needs:
    .venv/bin/python scripts/update_constraints.py            # newest versions
    .venv/bin/python scripts/update_constraints.py --keep     # keep the pins, add what is missing
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
FILE = ROOT / "requirements" / "constraints.txt"
INPUTS = [f"requirements/{name}.txt" for name in ("core", "ros", "dev", "docs", "peer")]
OWN = {"rbprm-core"}  # installed from the tree, not pinned
HEADER = """\
# Everything that gets installed, exactly; one file for Python 3.11 and 3.12.
# Made by scripts/update_constraints.py, not by hand.
"""


def canonical(name: str) -> str:
    """The name of a package in the spelling of an index."""
    return re.sub(r"[-_.]+", "-", name).lower()


def resolve(extra: list[str]) -> dict[str, str]:
    """Version by name of the packages that pip would install into an empty environment.

    Args:
        extra: additional arguments of pip.
    """
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "report.json"
        command = [sys.executable, "-m", "pip", "install", "--dry-run", "--ignore-installed"]
        # empy has no wheel; it is built with the installed setuptools, which are pinned.
        command += ["--no-build-isolation", "--only-binary=:all:", "--no-binary=empy"]
        command += ["--quiet", f"--report={report}", *extra]
        for name in INPUTS:
            command += ["--requirement", name]
        subprocess.run(command, cwd=ROOT, check=True)
        found = json.loads(report.read_text())["install"]
    return {canonical(i["metadata"]["name"]): i["metadata"]["version"] for i in found}


def main() -> None:
    """Write the constraints."""
    keep = "--keep" in sys.argv[1:]
    pins: dict[str, str] = {}
    if keep:
        lines = FILE.read_text().splitlines()
        pins = dict(line.split("==") for line in lines if not line.startswith("#"))
    found = resolve(["--constraint", str(FILE)] if keep else [])
    pins |= {name: version for name, version in found.items() if name not in OWN}
    FILE.write_text(HEADER + "".join(f"{name}=={pins[name]}\n" for name in sorted(pins)))
    print(f"{len(pins)} pins, of which {len(found)} are for this Python")


if __name__ == "__main__":
    main()
