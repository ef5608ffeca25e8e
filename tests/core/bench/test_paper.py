"""The figures of Tonneau et al. 2018 are complete and consistent."""

from __future__ import annotations

import pytest

from rbprm_core.bench.paper import PaperEntry, paper_figures
from rbprm_core.scenario import known_scenarios

PARTS = ("guide", "equilibrium", "collision", "projection", "total")


def tabled() -> dict[str, PaperEntry]:
    return {name: entry for name, entry in paper_figures().items() if entry.success is not None}


def test_every_scenario_of_its_tables_is_there() -> None:
    assert set(tabled()) == {"stairs", "standing", "car", "rubble", "rubble_full", "race"}
    assert {"step20", "step30", "step40", "pen", "stepladder"} <= set(paper_figures())


@pytest.mark.parametrize("name", sorted(tabled()))
def test_shares_of_contacts_make_a_whole(name: str) -> None:
    entry = tabled()[name]
    shares = (entry.contacts_found, entry.kinematic_failures, entry.equilibrium_failures)
    assert sum(share or 0.0 for share in shares) == pytest.approx(100.0, abs=0.15)


@pytest.mark.parametrize("name", sorted(tabled()))
@pytest.mark.parametrize("part", PARTS)
def test_minimum_mean_and_maximum_are_in_order(name: str, part: str) -> None:
    minimum, mean, maximum = getattr(tabled()[name], part)
    misprinted = part == "total" and name.startswith("rubble")  # noted in its entry
    assert minimum <= mean
    assert (mean <= maximum) != misprinted


@pytest.mark.parametrize("name", sorted(tabled()))
def test_a_step_takes_its_share_of_the_total(name: str) -> None:
    entry = tabled()[name]
    assert entry.total is not None
    assert entry.transitions is not None
    assert entry.per_transition == pytest.approx(entry.total[1] / entry.transitions, abs=0.51)


def test_its_scenarios_are_known() -> None:
    assert set(paper_figures()) <= set(known_scenarios())


@pytest.mark.parametrize(
    ("name", "total", "success", "transitions"),
    [
        ("stairs", (92, 261, 2174), 100, 18),
        ("standing", (371, 2257, 7671), 68, 24),
        ("car", (6919, 21416, 67031), 39, 61),
        ("rubble", (1548, 18058, 13126), 74, 71),
        ("race", (2797, 4187, 11292), 58, 112),
    ],
)
def test_figures_of_table_2(
    name: str, total: tuple[int, int, int], success: int, transitions: int
) -> None:
    entry = paper_figures()[name]
    assert (entry.total, entry.success, entry.transitions) == (total, success, transitions)
