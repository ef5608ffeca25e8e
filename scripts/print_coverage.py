"""Print the share of lines that the tests of the core ran, by room and in all.

    .venv/bin/python scripts/print_coverage.py FILE

FILE is what `slipcover --json --out FILE` wrote. The exit code is 1 where the share of all lines is
below the bar.
"""

from __future__ import annotations

import json
import sys
from collections import Counter, defaultdict
from pathlib import Path

PACKAGE = "rbprm_core"
BAR = 0.85  # share of all lines


def main() -> None:
    """Print the table; end with an exit code."""
    files = json.loads(Path(sys.argv[1]).read_text())["files"]
    executed: defaultdict[Path, set[int]] = defaultdict(set)
    known: defaultdict[Path, set[int]] = defaultdict(set)
    for name, file in files.items():
        path = Path(name).resolve()  # the workspace links to the sources: one file, two names
        executed[path].update(file["executed_lines"])
        known[path].update(file["executed_lines"], file["missing_lines"])
    ran: Counter[str] = Counter()
    lines: Counter[str] = Counter()
    for path in known:
        parts = path.with_suffix("").parts
        room = parts[len(parts) - parts[::-1].index(PACKAGE)]
        ran[room] += len(executed[path])
        lines[room] += len(known[path])
    print(f"coverage of {PACKAGE} in the process of its tests")
    for room in sorted(lines):
        print(f"  {room:<16} {ran[room] / max(lines[room], 1):6.1%} of {lines[room]:5} lines")
    share = ran.total() / lines.total()
    print(f"  {'all':<16} {share:6.1%} of {lines.total():5} lines; the bar is {BAR:.0%}")
    sys.exit(share < BAR)


if __name__ == "__main__":
    main()
