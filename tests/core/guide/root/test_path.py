"""Guide paths: marks and the points between them."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from rbprm_core.guide.root import GuidePath
from rbprm_core.guide.root_space import distance

Array = NDArray[np.float64]


@st.composite
def paths(draw: st.DrawFn) -> GuidePath:
    """Some nodes, a few of them twice in a row."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    count = draw(st.integers(2, 8))
    turns = [pin.Quaternion(pin.exp3(rng.uniform(-1, 1, 3))).coeffs() for _ in range(count)]
    nodes = np.hstack([rng.uniform(-3, 3, (count, 3)), turns])
    return GuidePath(np.repeat(nodes, rng.integers(1, 3, count), axis=0))


@given(paths())
def test_the_ends_are_exact(path: GuidePath) -> None:
    for mark, node in ((0.0, 0), (-1.0, 0), (path.length, -1), (path.length + 1, -1)):
        assert np.array_equal(path.at(mark), path.nodes[node])
    path.at(0.0)[:] = np.nan  # a copy
    assert np.isfinite(path.nodes).all()


@given(paths())
def test_marks_add_up(path: GuidePath) -> None:
    steps = [float(distance(a, b)) for a, b in zip(path.nodes, path.nodes[1:], strict=False)]
    assert np.diff(path.marks) == pytest.approx(steps)
    assert path.marks[0] == 0
    assert path.length == pytest.approx(sum(steps))


@given(paths())
def test_nodes_are_at_their_marks(path: GuidePath) -> None:
    for mark, node in zip(path.marks, path.nodes, strict=True):
        assert float(distance(path.at(mark), node)) == pytest.approx(0, abs=1e-7)


@given(paths(), st.floats(0, 1), st.floats(0, 1))
def test_no_way_along_the_path_is_shorter_than_the_crow_flies(
    path: GuidePath, first: float, second: float
) -> None:
    a, b = first * path.length, second * path.length
    assert float(distance(path.at(a), path.at(b))) <= abs(b - a) + 1e-6
    assert np.linalg.norm(path.at(a)[3:7]) == pytest.approx(1)


@given(paths(), st.integers(0, 2**32 - 1))
def test_many_points_at_once_are_those_one_by_one(path: GuidePath, seed: int) -> None:
    marks = np.random.default_rng(seed).uniform(-0.1, path.length + 0.1, 20)
    marks = np.concatenate([marks, path.marks])
    one_by_one = np.array([path.at(mark) for mark in marks])
    # At a node where an edge ends the long way round, the quaternion's sign is either.
    turned = np.abs((one_by_one[:, 3:7] * path.at_all(marks)[:, 3:7]).sum(axis=1))
    assert turned == pytest.approx(1)
    assert path.at_all(marks)[:, :3] == pytest.approx(one_by_one[:, :3])


def test_a_path_of_one_node_is_there_everywhere() -> None:
    node = np.array([[1.0, 2, 3, 0, 0, 0, 1]])
    assert np.array_equal(
        GuidePath(node).at_all(np.array([-1.0, 0, 2])), np.repeat(node, 3, axis=0)
    )
