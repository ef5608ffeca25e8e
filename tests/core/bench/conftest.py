"""A short scenario, and records made by hand."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from rbprm_core.bench import RunRecord
from rbprm_core.scenario import known_scenarios

MakeRecord = Callable[..., RunRecord]


@pytest.fixture(scope="session")
def stroll(tmp_path_factory: pytest.TempPathFactory) -> str:
    """File of the scenario `flat` with a goal that is 60 cm away."""
    text = known_scenarios()["flat"].read_text()
    near = text.replace(
        "goal = { position = [2.0, 0.0, 0.6] }", "goal = { position = [-1.4, 0.0, 0.6] }"
    )
    assert near != text
    file = tmp_path_factory.mktemp("stroll") / "flat.toml"
    file.write_text(near)
    return str(file)


@pytest.fixture
def make_record() -> MakeRecord:
    """Makes a record of one second of planning with four transitions; arguments change it."""

    def make(**changes: Any) -> RunRecord:
        phases = {"prepare": 0.1, "guide": 0.2, "shortcut": 0.1, "sequence": 0.6, "total": 1.0}
        values: dict[str, Any] = {
            "scenario": "rubble", "robot": "hyq", "seed": 0, "robustness": 10.0,
            "time_limit": 60.0, "failure": None, "seconds": phases, "wall": 1.1, "cpu": 0.9,
            "counts": {}, "states": 10, "transitions": 4, "violations": {},
        }  # fmt: skip
        return RunRecord(**(values | changes))

    return make
