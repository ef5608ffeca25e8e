"""Guide paths: arc lengths and the root configurations between nodes."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbprm_core.guide.root import GuidePath
from rbprm_core.guide.root_space import distance


@st.composite
def paths(draw: st.DrawFn) -> GuidePath:
    """Paths of random nodes, some repeated."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    count = draw(st.integers(2, 8))
    turns = [pin.Quaternion(pin.exp3(rng.uniform(-1, 1, 3))).coeffs() for _ in range(count)]
    nodes = np.hstack([rng.uniform(-3, 3, (count, 3)), turns])
    return GuidePath(np.repeat(nodes, rng.integers(1, 3, count), axis=0))


@given(paths())
def test_the_ends_are_exact(path: GuidePath) -> None:
    for s, node in ((0.0, 0), (-1.0, 0), (path.length, -1), (path.length + 1, -1)):
        assert np.array_equal(path.root(s), path.nodes[node])
    path.root(0.0)[:] = np.nan  # a copy
    assert np.isfinite(path.nodes).all()


@given(paths())
def test_arc_lengths_add_up(path: GuidePath) -> None:
    steps = [float(distance(a, b)) for a, b in zip(path.nodes, path.nodes[1:], strict=False)]
    assert np.diff(path.arc_lengths) == pytest.approx(steps)
    assert path.arc_lengths[0] == 0
    assert path.length == pytest.approx(sum(steps))


@given(paths())
def test_nodes_are_at_their_arc_lengths(path: GuidePath) -> None:
    for s, node in zip(path.arc_lengths, path.nodes, strict=True):
        assert float(distance(path.root(s), node)) == pytest.approx(0, abs=1e-7)


@given(paths(), st.floats(0, 1), st.floats(0, 1))
def test_no_part_of_a_path_is_shorter_than_the_distance_of_its_ends(
    path: GuidePath, first: float, second: float
) -> None:
    a, b = first * path.length, second * path.length
    assert float(distance(path.root(a), path.root(b))) <= abs(b - a) + 1e-6
    assert np.linalg.norm(path.root(a)[3:7]) == pytest.approx(1)


@given(paths(), st.integers(0, 2**32 - 1))
def test_many_points_at_once_are_those_one_by_one(path: GuidePath, seed: int) -> None:
    arc_lengths = np.random.default_rng(seed).uniform(-0.1, path.length + 0.1, 20)
    arc_lengths = np.concatenate([arc_lengths, path.arc_lengths])
    one_by_one = np.array([path.root(s) for s in arc_lengths])
    # Where an edge ends at a quaternion of opposite sign, the sign of the result may differ.
    turned = np.abs((one_by_one[:, 3:7] * path.roots(arc_lengths)[:, 3:7]).sum(axis=1))
    assert turned == pytest.approx(1)
    assert path.roots(arc_lengths)[:, :3] == pytest.approx(one_by_one[:, :3])


def test_a_path_of_one_node_is_constant() -> None:
    node = np.array([[1.0, 2, 3, 0, 0, 0, 1]])
    assert np.array_equal(GuidePath(node).roots(np.array([-1.0, 0, 2])), np.repeat(node, 3, axis=0))
