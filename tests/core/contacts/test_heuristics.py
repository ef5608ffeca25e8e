"""Heuristics: the formulas of section 5.2, and the ranking by their weighted sum."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from rbprm_core.contacts.heuristics import HEURISTICS, Candidates, check_names, rank
from rbprm_core.errors import InvalidInput

Array = NDArray[np.float64]
seeds = st.integers(0, 2**32 - 1)


def candidates(seed: int = 0, count: int = 30, **changes: Any) -> Candidates:
    """Some candidates; what later heuristics look at too is filled in with zeros."""
    rng = np.random.default_rng(seed)
    jacobians = rng.normal(size=(count, 3, 3))
    grams = jacobians @ np.swapaxes(jacobians, 1, 2)
    normals = rng.normal(size=(count, 3)) + 3 * np.eye(3)[2]
    share = rng.uniform(0, 1, count)
    direction = rng.normal(size=3)
    known: dict[str, Any] = {
        "grams": grams,
        "manipulability": np.sqrt(np.linalg.det(grams)),
        "normals": normals / np.linalg.norm(normals, axis=1)[:, None],
        "friction": rng.uniform(0.1, 1, count),
        "centers": rng.normal(size=(count, 3)),
        "nominal": rng.normal(size=3),
        "direction": direction / np.linalg.norm(direction),
        "persistence": lambda: share,
    }
    known.update(changes)
    return Candidates(**{field.name: known[field.name] for field in fields(Candidates)})


@given(seeds)
def test_effort_is_equation_15(seed: int) -> None:
    some = candidates(seed)
    found = HEURISTICS["effort"](some)
    m = -some.direction
    for gram, normal, friction, value in zip(
        some.grams, some.normals, some.friction, found, strict=True
    ):
        wanted = (m @ gram @ m) ** -0.5 * friction * (normal @ m)
        assert value == pytest.approx(wanted, rel=1e-6)


def test_effort_is_greatest_where_the_surface_faces_against_the_motion() -> None:
    some = candidates(
        count=3,
        grams=np.tile(np.eye(3), (3, 1, 1)),
        friction=np.ones(3),
        normals=np.array([[1.0, 0, 0], [0, 0, 1], [-1, 0, 0]]),
        direction=np.array([1.0, 0, 0]),
    )
    assert list(rank(some, {"effort": 1.0})) == [2, 1, 0]


def test_effort_of_a_root_at_rest_says_nothing() -> None:
    assert HEURISTICS["effort"](candidates(direction=np.zeros(3))) == pytest.approx(np.zeros(30))


@given(seeds)
def test_manipulability_is_equation_17(seed: int) -> None:
    some = candidates(seed)
    wanted = [np.sqrt(np.linalg.det(gram)) for gram in some.grams]
    assert HEURISTICS["manipulability"](some) == pytest.approx(wanted)
    best = rank(some, {"manipulability": 1.0})
    assert (np.diff(some.manipulability[best]) <= 0).all()


def test_persistence_is_asked_only_where_it_counts() -> None:
    asked: list[int] = []

    def tell() -> Array:
        asked.append(1)
        return np.arange(30.0)

    some = candidates(persistence=tell)
    rank(some, {"manipulability": 1.0})
    assert asked == []
    assert list(rank(some, {"persistence": 1.0})) == list(range(29, -1, -1))


@given(seeds, st.floats(0, 5), st.floats(0, 5))
def test_the_rank_is_by_the_weighted_sum_of_shares(seed: int, one: float, other: float) -> None:
    some = candidates(seed)
    order = rank(some, {"manipulability": one, "persistence": other})
    assert sorted(order) == list(range(30))
    parts = [some.manipulability, some.persistence()]
    shares = [part / np.abs(part).max() for part in parts]
    total = one * shares[0] + other * shares[1]
    assert (np.diff(total[order]) <= 1e-12).all()


def test_ties_keep_their_order() -> None:
    some = candidates(manipulability=np.ones(30))
    assert list(rank(some, {"manipulability": 1.0})) == list(range(30))
    assert list(rank(some, {})) == list(range(30))


@pytest.mark.parametrize("name", sorted(HEURISTICS))
def test_no_candidates_no_order(name: str) -> None:
    nobody: Callable[[], Array] = lambda: np.zeros(0)  # noqa: E731
    none = candidates(count=0, persistence=nobody)
    assert len(rank(none, {name: 1.0})) == 0


@pytest.mark.parametrize("name", sorted(HEURISTICS))
def test_every_heuristic_gives_one_number_a_candidate(name: str) -> None:
    values = HEURISTICS[name](candidates())
    assert values.shape == (30,)
    assert np.isfinite(values).all()


def test_an_unknown_name_lists_the_known_ones() -> None:
    check_names(dict.fromkeys(HEURISTICS, 1.0), "limbs.a.heuristics")
    with pytest.raises(InvalidInput, match="effort, manipulability") as caught:
        check_names({"manipulability": 1.0, "intuition": 2.0}, "limbs.a.heuristics")
    assert (caught.value.field, caught.value.value) == ("limbs.a.heuristics", "intuition")
