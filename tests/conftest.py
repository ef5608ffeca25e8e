"""What tests of the core and benches share."""

from __future__ import annotations

import re
import signal

import pytest

from rbprm_core.robot import known_robots

# A shell's background jobs ignore SIGINT, and so would every program that a test starts and then
# interrupts: a handled signal is back at its default in a new program, an ignored one is not.
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session")
def quick_hyq(tmp_path_factory: pytest.TempPathFactory) -> str:
    """File of HyQ with fewer samples: its data take a second."""
    text = re.sub(r"^samples = .*\n", "", known_robots()["hyq"].read_text(), flags=re.MULTILINE)
    text = re.sub(r"^(\[volumes\])$", r"\1\nsamples = 3000", text, flags=re.MULTILINE)
    text = re.sub(r"^(\[\[limbs\]\])$", r"\1\nsamples = 2000", text, flags=re.MULTILINE)
    file = tmp_path_factory.mktemp("quick") / "hyq.toml"
    file.write_text(text)
    return str(file)
