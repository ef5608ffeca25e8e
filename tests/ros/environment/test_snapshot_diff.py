"""Differences between snapshots of the environment."""

from __future__ import annotations

import pickle

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from rbprm_core.plan_record import SurfaceEntry
from rbprm_ros.environment.snapshot import Obstacle, Snapshot
from rbprm_ros.environment.snapshot_diff import apply_diff, diff_between
from rbprm_ros.environment.store import Environment
from rbprm_ros.environment.updates import SurfaceUpdate
from rbprm_ros.settings import Settings

NAMES = st.sampled_from("abcdef")
PARTS = st.dictionaries(NAMES, st.integers(0, 2), max_size=6)
"""Sizes of surfaces and obstacles by name."""


def snapshot_of(environment: Environment, parts: dict[str, int]) -> Snapshot:
    """The environment with exactly the given surfaces and obstacles."""
    entries, obstacles = [], []
    for name, size in parts.items():
        corners = ((0, 0, 0), (1 + size, 0, 0), (1 + size, 1, 0), (0, 1, 0))
        if name < "d":
            entries.append(SurfaceEntry(id=name, vertices=corners))
        else:
            obstacles.append(Obstacle(name, np.array([corners[:3]], dtype=float)))
    update = SurfaceUpdate(tuple(entries), obstacles=tuple(obstacles))
    return environment.update(update, Settings())


@given(before=PARTS, after=PARTS)
def test_a_change_makes_the_later_of_the_earlier(
    before: dict[str, int], after: dict[str, int]
) -> None:
    environment = Environment()
    old, new = snapshot_of(environment, before), snapshot_of(environment, after)
    diff = diff_between(old, new)
    found = apply_diff(old, diff)
    assert (found.version, found.stamp, found.entry) == (new.version, new.stamp, new.entry)
    assert found.surfaces == new.surfaces
    assert found.obstacles == new.obstacles
    sent = [item for item in (*diff.surfaces, *diff.obstacles) if not isinstance(item, int)]
    assert len(sent) == sum(before.get(name) != size for name, size in after.items())


def test_a_change_of_one_surface_is_small() -> None:
    environment = Environment()
    corners = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0))
    entries = tuple(SurfaceEntry(id=f"s{i}", vertices=corners) for i in range(200))
    old = environment.update(SurfaceUpdate(entries), Settings())
    new = environment.update(SurfaceUpdate(is_diff=True, removed=("s7",)), Settings())
    whole = len(pickle.dumps(diff_between(Snapshot(), new)))
    assert len(pickle.dumps(diff_between(old, new))) < whole / 50
