"""Footholds of flat feet: patches that lie on their surface as a whole, steady ones first."""

from __future__ import annotations

import dataclasses
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from rbprm_core.body.contact import Contact
from rbprm_core.contacts.along_guide import ContactGenerator, start_state
from rbprm_core.contacts.along_guide.balance import Balance
from rbprm_core.contacts.along_guide.footholds import (
    FootholdFinder,
    Footholds,
    _over_support,
    _turned,
)
from rbprm_core.contacts.along_guide.look_ahead import LookAhead
from rbprm_core.contacts.along_guide.options import GeneratorOptions
from rbprm_core.robot.data import RobotData
from rbprm_core.robot.model import ROOT_JOINT
from rbprm_core.scene import Scene, make_surface

Array = NDArray[np.float64]
GRAVITY = np.array([0.0, 0.0, -9.81])
MARGIN = 0.02  # metres
OPTIONS = GeneratorOptions(edge_margin=MARGIN, candidates=100_000)  # all that there are
seeds = st.integers(0, 2**32 - 1)

SQUARE = ((-0.6, -0.6), (0.6, -0.6), (0.6, 0.6), (-0.6, 0.6))
ELL = ((-0.6, -0.6), (0.6, -0.6), (0.6, 0.0), (0.0, 0.0), (0.0, 0.6), (-0.6, 0.6))
COMB = (
    (-0.6, -0.6), (0.6, -0.6), (0.6, 0.6), (0.2, 0.6), (0.2, -0.2), (0.1, -0.2), (0.1, 0.6),
    (-0.3, 0.6), (-0.35, -0.3), (-0.4, 0.6), (-0.6, 0.6),
)  # fmt: skip
HOLE = ((0.05, -0.05), (0.15, -0.05), (0.15, 0.15), (0.05, 0.15))
SLOT = ((-0.4, -0.31), (0.3, -0.24), (0.3, -0.22), (-0.4, -0.29))
SHAPES = {
    "square": (SQUARE, ()),
    "ell": (ELL, ()),
    "comb": (COMB, ()),
    "holed": (SQUARE, (HOLE,)),
    "two holes": (SQUARE, (SLOT, HOLE[:3])),
}


def one_surface(name: str, turn: Array) -> Scene:
    """One of the shapes, turned out of the ground plane by a rotation vector (3,)."""
    shell, holes = SHAPES[name]
    rotation = pin.exp3(turn)
    ring, *inner = (np.pad(np.array(r), ((0, 0), (0, 1))) @ rotation.T for r in (shell, *holes))
    return Scene([make_surface(name, ring, 0.5, tuple(inner))])


def over(data: RobotData, rng: np.random.Generator) -> Array:
    """A standing configuration (nq,) of Talos with its feet about the origin of the ground."""
    q = data.robot.reference.copy()
    q[:3] = [*rng.uniform(-0.3, 0.3, 2), data.height + rng.uniform(-0.1, 0.02)]
    q[3:7] = pin.Quaternion(pin.exp3(np.array([0, 0, rng.uniform(-np.pi, np.pi)]))).coeffs()
    return q


def base_at(q: Array) -> pin.SE3:
    return pin.XYZQUATToSE3(q[:7])


def find(
    data: RobotData, finder: FootholdFinder, limb: int, q: Array, com: Array | None = None
) -> Footholds:
    assert data.robot.limbs[limb].base == ROOT_JOINT
    middle = q[:3] if com is None else com
    balance = Balance(middle, 0.0, base_at(q), data.databases[limb].coms)
    batches = finder.find(limb, base_at(q), LookAhead.still(q[:7]), None, [], balance)
    return joined([nothing(), *batches])


def nothing() -> Footholds:
    none = np.zeros(0, dtype=int)
    return Footholds(none, none, np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((0, 3, 3)))


def joined(batches: list[Footholds]) -> Footholds:
    """Footholds of several batches in one."""
    fields = [f.name for f in dataclasses.fields(Footholds)]
    return Footholds(*(np.concatenate([getattr(b, name) for b in batches]) for name in fields))


def contacts_of(
    data: RobotData, finder: FootholdFinder, limb: int, q: Array
) -> tuple[list[Contact], int]:
    """Contacts of a limb, and how many footholds gave none."""
    found = find(data, finder, limb, q)
    frames = [pin.SE3(found.rotations[i], found.targets[i]) for i in range(len(found))]
    made = [
        finder.contact(limb, int(piece), base_at(q) * frame)
        for piece, frame in zip(found.pieces, frames, strict=True)
    ]
    kept = [contact for contact in made if contact is not None]
    return kept, len(made) - len(kept)


def flat_shape(scene: Scene) -> shapely.Polygon:
    polygon = scene.surfaces[0].polygon
    flatten = polygon.plane.flatten
    return shapely.Polygon(flatten(polygon.boundary), [flatten(hole) for hole in polygon.holes])


@settings(max_examples=60)
@given(seed=seeds, name=st.sampled_from(sorted(SHAPES)), limb=st.integers(0, 1))
def test_a_patch_lies_inside_its_surface_as_a_whole(
    talos_data: RobotData, seed: int, name: str, limb: int
) -> None:
    rng = np.random.default_rng(seed)
    scene = one_surface(name, np.array([*rng.uniform(-0.15, 0.15, 2), rng.uniform(-3, 3)]))
    finder = FootholdFinder(talos_data, scene, OPTIONS)
    plane, shape = scene.surfaces[0].polygon.plane, flat_shape(scene)
    x, y = talos_data.robot.limbs[limb].corners[0, :2]
    for contact in contacts_of(talos_data, finder, limb, over(talos_data, rng))[0]:
        assert contact.points.shape == (4, 3)
        assert contact.generators.shape == (4, 4, 3)
        assert (contact.points - plane.origin) @ plane.normal == pytest.approx(np.zeros(4))
        assert contact.normal == pytest.approx(plane.normal)
        assert contact.points.mean(axis=0) == pytest.approx(contact.position)
        arms = (contact.points - contact.position) @ contact.rotation[:, :2]
        assert arms == pytest.approx(np.array([[x, y], [-x, y], [-x, -y], [x, -y]]))
        patch = shapely.Polygon(plane.flatten(contact.points))
        assert patch.area == pytest.approx(4 * x * y)
        assert patch.within(shape)
        assert patch.distance(shape.boundary) >= MARGIN - 1e-9


@pytest.mark.parametrize("name", sorted(SHAPES))
def test_there_is_room_for_many_patches(talos_data: RobotData, name: str) -> None:
    rng = np.random.default_rng(3)
    finder = FootholdFinder(talos_data, one_surface(name, np.zeros(3)), OPTIONS)
    made = refused = 0
    for k in range(20):
        kept, lost = contacts_of(talos_data, finder, k % 2, over(talos_data, rng))
        made, refused = made + len(kept), refused + lost
    assert made > 50
    if name == "square":
        assert refused == 0  # a convex surface's edges are tested before


def test_no_patch_on_a_plank_that_is_too_narrow(talos_data: RobotData) -> None:
    rng = np.random.default_rng(4)
    found = []
    for half in (0.065 + MARGIN - 1e-3, 0.3):
        ring = [[-2, -half, 0], [2, -half, 0], [2, half, 0], [-2, half, 0]]
        finder = FootholdFinder(talos_data, Scene([make_surface("plank", ring, 0.5)]), OPTIONS)
        found.append(sum(len(find(talos_data, finder, 0, over(talos_data, rng))) for _ in range(9)))
    assert found[0] == 0
    assert found[1] > 9


@pytest.mark.parametrize(
    ("name", "place", "lies"),
    [
        ("ell", (-0.3, 0.3), True),
        ("ell", (-0.13, 0.3), True),
        ("ell", (-0.11, 0.3), False),  # less than the margin from the inner edge
        ("ell", (0.05, 0.05), False),  # three corners of four are on the surface
        ("ell", (0.0, -0.2), True),  # across the pieces' common edge
        ("ell", (0.3, 0.3), False),
        ("holed", (0.4, 0.05), True),
        ("holed", (0.1, 0.05), False),  # about the hole
        ("holed", (-0.06, 0.05), False),  # its edge is in the margin of the hole
        ("holed", (-0.08, 0.05), True),
        ("two holes", (-0.05, -0.265), False),  # the slot passes between the corners
        ("comb", (0.15, 0.3), False),
    ],
)
def test_a_patch_that_lies_on_the_surface_in_part_is_none(
    talos_data: RobotData, name: str, place: tuple[float, float], lies: bool
) -> None:
    scene = one_surface(name, np.zeros(3))
    finder = FootholdFinder(talos_data, scene, OPTIONS)
    frame = pin.SE3(np.eye(3), np.array([*place, 0.0]))
    contact = finder.contact(0, 0, frame)
    assert (contact is not None) == lies


@settings(max_examples=100)
@given(seed=seeds, corners=st.integers(1, 4), others=st.integers(0, 8))
def test_steady_is_over_the_hull_of_the_contacts(seed: int, corners: int, others: int) -> None:
    rng = np.random.default_rng(seed)
    points, standing = rng.normal(size=(20, corners, 2)), rng.normal(size=(others, 2))
    coms = 0.5 * rng.normal(size=(20, 2))
    steady = _over_support(points, standing, coms)
    for new, com, answer in zip(points, coms, steady, strict=True):
        hull = shapely.MultiPoint(np.vstack([new, standing])).convex_hull
        assert answer == hull.contains(shapely.Point(com))


@settings(max_examples=40)
@given(seed=seeds, limb=st.integers(0, 1), off=st.floats(-0.3, 0.3))
def test_steady_footholds_come_first_and_none_is_lost(
    talos_data: RobotData, flat_scene: Scene, seed: int, limb: int, off: float
) -> None:
    q = over(talos_data, np.random.default_rng(seed))
    finder = FootholdFinder(talos_data, flat_scene, OPTIONS)
    com = q[:3] + np.array([off, 0.1, 0.0])
    far = find(talos_data, finder, limb, q, com + 50.0)  # nowhere steady: as ranked
    found = find(talos_data, finder, limb, q, com)
    assert len(found) == len(far) > 0
    places = [tuple(target) for target in far.targets]
    order = [places.index(tuple(target)) for target in found.targets]
    assert sorted(order) == list(range(len(far)))
    assert np.array_equal(found.samples, far.samples[order])
    assert np.array_equal(found.pieces, far.pieces[order])
    assert np.array_equal(found.rotations, far.rotations[order])
    corners = talos_data.robot.limbs[limb].corners
    rotations = base_at(q).rotation @ found.rotations
    centers = found.targets @ base_at(q).rotation.T + q[:3]
    points = centers[:, None] + corners @ np.swapaxes(rotations, 1, 2)
    coms = np.tile(com[:2], (len(found), 1))
    steady = _over_support(points[..., :2], np.zeros((0, 2)), coms)
    count = int(steady.sum())
    assert steady[:count].all()
    assert order[:count] == sorted(order[:count])
    assert order[count:] == sorted(order[count:])


@settings(max_examples=40)
@given(seed=seeds, limb=st.integers(0, 1), off=st.floats(-0.3, 0.3), most=st.integers(1, 300))
def test_fewer_footholds_are_the_first_of_all(
    talos_data: RobotData, flat_scene: Scene, seed: int, limb: int, off: float, most: int
) -> None:
    q = over(talos_data, np.random.default_rng(seed))
    com = q[:3] + np.array([off, 0.1, 0.0])
    fewer = replace(OPTIONS, candidates=most)
    found = find(talos_data, FootholdFinder(talos_data, flat_scene, fewer), limb, q, com)
    every = find(talos_data, FootholdFinder(talos_data, flat_scene, OPTIONS), limb, q, com)
    assert len(found) == min(most, len(every))
    assert np.array_equal(found.samples, every.samples[:most])
    assert np.array_equal(found.targets, every.targets[:most])


@settings(max_examples=100)
@given(seed=seeds, most=st.floats(1e-6, 3.0))
def test_turned_rotations_are_proper_and_turn_least(seed: int, most: float) -> None:
    rng = np.random.default_rng(seed)
    rotations = np.array([pin.exp3(rng.uniform(-2, 2, 3)) for _ in range(20)])
    axes = rotations[:, :, 2]
    across = np.cross(axes, rng.normal(size=(20, 3)))
    across /= np.linalg.norm(across, axis=1)[:, None]
    angles = rng.uniform(0, most, 20)
    normals = np.cos(angles)[:, None] * axes + np.sin(angles)[:, None] * across
    found = _turned(rotations, normals, np.cos(angles))
    assert found @ np.swapaxes(found, 1, 2) == pytest.approx(np.tile(np.eye(3), (20, 1, 1)))
    assert np.linalg.det(found) == pytest.approx(np.ones(20))
    assert found[:, :, 2] == pytest.approx(normals)
    for before, after, angle in zip(rotations, found, angles, strict=True):
        assert np.linalg.norm(pin.log3(after @ before.T)) == pytest.approx(angle, abs=1e-6)


def test_a_flat_foot_stands_where_its_contact_says(
    talos_data: RobotData, flat_scene: Scene
) -> None:
    robot = talos_data.robot
    generator = ContactGenerator(talos_data, flat_scene, GRAVITY, 2.0)
    root = np.array([0.0, 0.0, talos_data.height - 0.02, 0.0, 0.0, 0.0, 1.0])
    state = start_state(generator, root, (0, 1))
    scratch = robot.model.createData()
    shifted = state.q.copy()
    shifted[:2] += [0.02, -0.01]
    for contact in state.contacts:
        moved = generator.body.project(shifted, contact)
        assert moved is not None
        for q in (state.q, moved):
            pin.framesForwardKinematics(robot.model, scratch, q)
            limb = robot.limbs[contact.limb]
            there = scratch.oMf[limb.frame] * limb.contact
            assert there.translation == pytest.approx(contact.position, abs=2e-5)
            assert there.rotation == pytest.approx(contact.rotation, abs=2e-4)
            assert there.act(limb.corners[0]) == pytest.approx(contact.points[0], abs=1e-4)
    assert generator.body.robustness(state.q, state.contacts) == pytest.approx(state.robustness)
    assert state.robustness >= 2.0
