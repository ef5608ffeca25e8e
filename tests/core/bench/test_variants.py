"""Scenarios of growing size keep the path of the original."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from rbprm_core.bench import RunRecord
from rbprm_core.bench.machine import this_machine
from rbprm_core.bench.scaling import BLOCK, PHASES, Growth, Size, growth_with_length
from rbprm_core.bench.scaling_report import growth_table, write_growth
from rbprm_core.bench.variants import longer, surrounded
from rbprm_core.errors import InvalidInput
from rbprm_core.scenario import Scenario, load_scenario

MakeRecord = Callable[..., RunRecord]


def test_once_as_long_is_the_scenario_itself(rubble: Scenario) -> None:
    once = longer(rubble, 1)
    assert once.environment == rubble.environment
    assert once.request == rubble.request


def test_a_longer_way_repeats_what_is_on_it(rubble: Scenario) -> None:
    whole, thrice = rubble.scene(), longer(rubble, 3).scene()
    assert len(thrice.surfaces) == 3 * len(whole.surfaces)
    span = rubble.request.goal.position[0] - rubble.request.start.position[0]
    goal = longer(rubble, 3).request.goal.position
    assert goal[0] == pytest.approx(rubble.request.start.position[0] + 3 * span)
    low = whole.triangles.reshape(-1, 3).min(axis=0)
    high = whole.triangles.reshape(-1, 3).max(axis=0)
    corners = thrice.triangles.reshape(-1, 3)
    assert corners.min(axis=0) == pytest.approx(low, abs=1e-6)
    assert corners.max(axis=0) == pytest.approx([high[0] + 2 * span, *high[1:]], abs=1e-6)
    assert longer(rubble, 3).request.bounds.x[1] >= goal[0]


@pytest.mark.parametrize("count", [1, 10, 333])
def test_surfaces_around_are_out_of_reach_and_apart(count: int) -> None:
    text = load_scenario(str(BLOCK))
    more = surrounded(text, count)
    assert more.request == text.request
    own = len(text.environment.surfaces)
    assert more.environment.surfaces[:own] == text.environment.surfaces
    tiles = np.array([tile.vertices for tile in more.environment.surfaces[own:]])
    assert tiles.shape == (count, 4, 3)
    edge = max(abs(v[1]) for s in text.environment.surfaces for v in s.vertices)
    assert (np.abs(tiles[:, :, 1]).min(axis=1) >= edge + 0.9).all()
    centers = tiles.mean(axis=1)
    gaps = np.linalg.norm(centers[:, None] - centers, axis=-1) + np.eye(count) * 9
    assert gaps.min() > 0.59
    assert all(s.kind == "support" for s in more.scene().surfaces[own:])


def growth(make_record: MakeRecord, exponent: float) -> Growth:
    sizes = []
    for size in (1.0, 2.0, 4.0, 8.0):
        seconds = dict.fromkeys(PHASES, size**exponent)
        runs = [
            make_record(cpu=size**exponent, seed=s, seconds=seconds | {"total": 4 * size**exponent})
            for s in range(3)
        ]
        sizes.append(Size(size, 7, 0.1, tuple(runs)))
    return Growth("length", "m", this_machine(), tuple(sizes))


@pytest.mark.parametrize("exponent", [0.0, 0.5, 1.0, 2.0])
def test_the_exponent_of_a_power_law_is_found(make_record: MakeRecord, exponent: float) -> None:
    found = growth(make_record, exponent)
    assert found.exponent() == pytest.approx(exponent, abs=1e-9)
    assert found.last_exponent("guide") == pytest.approx(exponent, abs=1e-9)


def test_growth_is_written(make_record: MakeRecord, tmp_path: Path) -> None:
    found = growth(make_record, 1.0)
    data, text, plot = write_growth(found, tmp_path)
    assert text.read_text() == growth_table(found) + "\n"
    assert "| exponent |" in text.read_text()
    assert data.stat().st_size > 0
    assert plot.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("sizes", [(), (1,), (0, 2)])
def test_sizes_that_show_no_growth(sizes: tuple[int, ...]) -> None:
    with pytest.raises(InvalidInput) as caught:
        growth_with_length(sizes)
    assert caught.value.field == "sizes"
