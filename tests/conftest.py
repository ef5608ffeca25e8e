"""What tests of the core and benches share."""

from __future__ import annotations

import re

import pytest

from rbprm_core.robot import known_robots


@pytest.fixture(scope="session")
def quick_hyq(tmp_path_factory: pytest.TempPathFactory) -> str:
    """File of HyQ with fewer samples: its data take a second."""
    text = re.sub(r"^samples = .*\n", "", known_robots()["hyq"].read_text(), flags=re.MULTILINE)
    text = re.sub(r"^(\[volumes\])$", r"\1\nsamples = 3000", text, flags=re.MULTILINE)
    text = re.sub(r"^(\[\[limbs\]\])$", r"\1\nsamples = 2000", text, flags=re.MULTILINE)
    file = tmp_path_factory.mktemp("quick") / "hyq.toml"
    file.write_text(text)
    return str(file)
