"""The grid of limb samples against a brute-force search over all samples."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rbprm_core.robot.data import RobotData
from rbprm_core.robot.database import LimbDatabase
from rbprm_core.scene import Scene, Surface, make_surface
from rbprm_core.surface_kind import SurfaceKind

Box = Callable[..., list[Surface]]

KINDS = (SurfaceKind.SUPPORT, SurfaceKind.LEAN, SurfaceKind.OTHER)
L_SHAPE = 0.3 * np.array([[0, 0, 0], [2, 0, 0], [2, 1, 0], [1, 1, 0], [1, 2, 0], [0, 2, 0.0]])
SCENE = Scene([make_surface("l", L_SHAPE, 0.5), make_surface("wall", L_SHAPE[:, [2, 0, 1]], 0.5)])


@settings(max_examples=60)
@given(seed=st.integers(0, 2**32 - 1), limb=st.integers(0, 3), band=st.floats(0.001, 0.3))
def test_near_is_what_brute_force_finds(
    hyq_data: RobotData, seed: int, limb: int, band: float
) -> None:
    database = hyq_data.databases[limb]
    rng = np.random.default_rng(seed)
    rotation = pin.exp3(rng.uniform(-2, 2, 3))
    centre = database.positions[rng.integers(len(database.positions))]
    shift = centre - rotation @ [0.3, 0.3, 0] + rng.normal(size=3) * 0.2
    pieces = SCENE.pieces(KINDS)
    normals = pieces.normals @ rotation.T
    offsets = pieces.offsets + normals @ shift
    edges = pieces.edge_normals @ rotation.T
    edge_offsets = pieces.edge_offsets + edges @ shift

    samples, near = database.near(normals, offsets, edges, edge_offsets, band)
    points = database.positions
    heights = np.abs(points @ normals.T - offsets)
    inside = (np.einsum("pek,nk->npe", edges, points) >= edge_offsets).all(axis=2)
    wanted = set(zip(*np.nonzero((heights <= band) & inside), strict=True))
    assert len(samples) == len(wanted)
    assert set(zip(samples.tolist(), near.tolist(), strict=True)) == wanted


@pytest.mark.parametrize("size", [0.01, 0.1, 10.0])
def test_the_size_of_a_limb_does_not_matter(hyq_data: RobotData, size: float) -> None:
    """A finger has smaller cells than a leg, and finds the same samples."""
    leg = hyq_data.databases[0]
    jacobians = np.zeros((len(leg.joints), 3, 3))
    finger = LimbDatabase(leg.joints, size * leg.positions, leg.rotations, jacobians, leg.coms)
    pieces = SCENE.pieces(KINDS)
    shift = leg.positions.mean(axis=0) - [0.3, 0.3, 0.0]
    offsets = pieces.offsets + pieces.normals @ shift
    edge_offsets = pieces.edge_offsets + pieces.edge_normals @ shift
    samples, _ = leg.near(pieces.normals, offsets, pieces.edge_normals, edge_offsets, 0.05)
    found, _ = finger.near(
        pieces.normals, size * offsets, pieces.edge_normals, size * edge_offsets, size * 0.05
    )
    assert len(found) > 100
    before, after = leg.joints[samples], finger.joints[found]
    assert np.array_equal(before[np.lexsort(before.T)], after[np.lexsort(after.T)])


def test_nothing_is_near_what_is_far(hyq_data: RobotData) -> None:
    database = hyq_data.databases[0]
    pieces = SCENE.pieces(KINDS)
    away = float(np.linalg.norm(database.positions, axis=1).max()) + 5.0
    found = database.near(
        pieces.normals,
        pieces.offsets + pieces.normals @ [away, away, away],
        pieces.edge_normals,
        pieces.edge_offsets + pieces.edge_normals @ [away, away, away],
        0.04,
    )
    assert [len(part) for part in found] == [0, 0]


def test_no_piece_no_sample(hyq_data: RobotData) -> None:
    none = Scene([], np.zeros((1, 3, 3))).pieces(KINDS)
    found = hyq_data.databases[0].near(
        none.normals, none.offsets, none.edge_normals, none.edge_offsets, 0.04
    )
    assert [len(part) for part in found] == [0, 0]


def test_the_database_is_the_samples_in_another_order() -> None:
    rng = np.random.default_rng(0)
    joints, positions = rng.uniform(-1, 1, (200, 3)), rng.uniform(-1, 1, (200, 3))
    rotations, jacobians = rng.normal(size=(2, 200, 3, 3))
    database = LimbDatabase(joints, positions, rotations, jacobians, 2 * positions)
    order = np.array([np.flatnonzero((joints == q).all(axis=1))[0] for q in database.joints])
    assert sorted(order) == list(range(200))
    assert np.array_equal(database.positions, positions[order])
    assert np.array_equal(database.coms, 2 * positions[order])
    assert np.array_equal(database.rotations, rotations[order])
    wanted = jacobians[order] @ np.swapaxes(jacobians[order], 1, 2)
    assert database.grams == pytest.approx(wanted)
    assert database.manipulability == pytest.approx(np.abs(np.linalg.det(jacobians[order])))


@settings(max_examples=40)
@given(seed=st.integers(0, 2**32 - 1), limb=st.integers(0, 3))
def test_the_box_holds_every_effector(hyq_data: RobotData, seed: int, limb: int) -> None:
    rng = np.random.default_rng(seed)
    rotation, translation = pin.exp3(rng.uniform(-2, 2, 3)), rng.uniform(-5, 5, 3)
    database = hyq_data.databases[limb]
    points = database.positions @ rotation.T + translation
    low, high = database.box(rotation, translation)
    assert (low <= points.min(axis=0) + 1e-9).all()
    assert (high >= points.max(axis=0) - 1e-9).all()
    low, high = database.box(np.eye(3), np.zeros(3))
    assert low == pytest.approx(database.positions.min(axis=0))
    assert high == pytest.approx(database.positions.max(axis=0))
