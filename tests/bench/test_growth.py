"""Planning time grows no worse than linearly with the way, and hardly with what is around it.

Counted in operations, which any machine repeats exactly; the exponent of the time is measured on
longer ways and more surfaces by `rbprm bench-scaling`. The bounds are wider than what that gives:
three times the way is too short for an even share of every obstacle.
"""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from rbprm_core.bench.scaling import Growth, growth_with_length, growth_with_surfaces

OPERATIONS = ("candidates", "projection", "statics", "collision", "roots")


@pytest.fixture(scope="module", autouse=True)
def cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """A cache of this module's own."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RBPRM_CACHE_DIR", str(tmp_path_factory.mktemp("cache")))
        yield


def counts(growth: Growth) -> list[dict[str, int]]:
    assert all(size.successes == len(size.records) for size in growth.sizes)
    return [size.records[0].counts for size in growth.sizes]


def test_three_times_the_way(quick_hyq: str) -> None:
    growth = growth_with_length((1, 3), range(1), robot=quick_hyq)
    once, thrice = counts(growth)
    for name in OPERATIONS:
        assert thrice[name] < 1.6 * 3 * once[name]


def test_fifty_times_the_surfaces(quick_hyq: str) -> None:
    growth = growth_with_surfaces((10, 500), range(1), robot=quick_hyq)
    few, many = counts(growth)
    for name in OPERATIONS:
        assert many[name] < 2 * few[name]
