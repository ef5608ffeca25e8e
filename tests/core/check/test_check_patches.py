"""Patches that overhang gaps, holes and notches between their corners."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.geometry import Polygon

from rbprm_core.check import Kind
from rbprm_core.check.contact_placement import placement_violations
from rbprm_core.check.patches import Patches
from rbprm_core.check.plan_environment import Environment
from rbprm_core.plan_record import ContactEntry, EnvironmentEntry, SurfaceEntry

HALF = np.array([0.1, 0.065])
Ring = list[tuple[float, float]]


def rectangle(x: tuple[float, float], y: tuple[float, float]) -> Ring:
    return [(x[0], y[0]), (x[1], y[0]), (x[1], y[1]), (x[0], y[1])]


def ground(*rings: Ring, holes: tuple[Ring, ...] = (), heights: tuple[float, ...] = ()) -> Patches:
    """Patch measurement on level surfaces, the first of them with holes."""
    entries = []
    for k, ring in enumerate(rings):
        z = heights[k] if heights else 0.0
        inner = tuple(tuple((x, y, z) for x, y in hole) for hole in holes) if k == 0 else ()
        vertices = tuple((x, y, z) for x, y in ring)
        entries.append(SurfaceEntry(id=f"surface_{k}", vertices=vertices, holes=inner))
    return Patches(Environment(EnvironmentEntry(surfaces=tuple(entries))))


def sole(x: float = 0.0, y: float = 0.0, z: float = 0.0, yaw: float = 0.0) -> ContactEntry:
    """A planar contact as large as a sole."""
    turn = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
    corners = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * HALF @ turn.T + [x, y]
    return ContactEntry(
        limb="leg",
        frame="sole",
        type="planar",
        position=(x, y, z),
        orientation=(0, 0, np.sin(yaw / 2), np.cos(yaw / 2)),
        normal=(0, 0, 1),
        points=tuple((a, b, z) for a, b in corners.tolist()),
        friction=0.5,
    )


def kinds(patches: Patches, contact: ContactEntry) -> list[str]:
    return [violation.kind for violation in patches.violations(contact, 0)]


WIDE = rectangle((-2, 2), (-2, 2))
LEFT, RIGHT = rectangle((-2, 0), (-2, 2)), rectangle((0.02, 2), (-2, 2))


def test_a_patch_that_lies_does_not_overhang() -> None:
    patches = ground(WIDE)
    for contact in (sole(), sole(yaw=0.7), sole(z=0.0029), sole(x=1.902)):
        assert kinds(patches, contact) == []
    assert (patches.overhanging, patches.unsupported) == (0, 0.0)


def test_a_patch_over_a_gap_of_two_surfaces() -> None:
    """A gap of 2 cm under the middle of the sole, less the bound of 3 mm on either side."""
    patches = ground(LEFT, RIGHT)
    assert kinds(patches, sole(x=0.01)) == [Kind.OVERHANG]
    assert patches.unsupported == pytest.approx(0.014 / 0.2, abs=0.01)
    assert patches.overhanging == 1
    assert list(placement_violations(patches._environment, sole(x=0.01), 0)) == []
    assert kinds(ground(LEFT, rectangle((0.005, 2), (-2, 2))), sole()) == []  # too narrow


def test_a_patch_over_a_hole_and_over_a_notch() -> None:
    hole = rectangle((-0.03, 0.03), (-0.03, 0.03))
    patches = ground(WIDE, holes=(hole,))
    assert kinds(patches, sole()) == [Kind.OVERHANG]
    assert patches.unsupported == pytest.approx(0.054**2 / 0.026, rel=0.2)
    notch = [(-2, -2), (2, -2), (2, 0.2), (0.06, 0.2), (0.0, 0.02), (-0.06, 0.2), (-2, 0.2)]
    patches = ground(notch)
    assert kinds(patches, sole()) == [Kind.OVERHANG]  # the notch is cut into an edge of the sole
    assert kinds(patches, sole(y=-0.06)) == []


def test_a_step_under_the_sole() -> None:
    low = rectangle((-0.05, 0.05), (-2, 2))
    sides = [rectangle((-2, -0.05), (-2, 2)), rectangle((0.05, 2), (-2, 2))]
    assert kinds(ground(*sides, low, heights=(0, 0, -0.002)), sole()) == []
    patches = ground(*sides, low, heights=(0, 0, -0.02))
    assert kinds(patches, sole()) == [Kind.OVERHANG]
    assert patches.unsupported == pytest.approx(0.5, abs=0.05)


def test_corners_off_are_counted_but_reported_once() -> None:
    """A corner off the environment is a violation of another kind."""
    patches = ground(WIDE)
    contact = sole(x=1.95)
    assert kinds(patches, contact) == []
    found = list(placement_violations(patches._environment, contact, 0))
    assert [violation.kind for violation in found] == [Kind.OFF_ENVIRONMENT]
    assert patches.overhanging == 1
    assert patches.unsupported == pytest.approx(0.047 / 0.2, abs=0.02)


def test_a_kept_contact_is_measured_once_and_reported_for_every_state() -> None:
    patches = ground(LEFT, RIGHT)
    contact = sole(x=0.01)
    found = [violation for k in range(3) for violation in patches.violations(contact, k)]
    assert [violation.state for violation in found] == [0, 1, 2]
    assert patches.overhanging == 3
    assert "of the patch" in str(found[0])


def test_points_have_no_patch() -> None:
    contact = sole(x=5.0).model_copy(update={"type": "point"})
    assert kinds(ground(WIDE), contact) == []


@settings(max_examples=30)
@given(st.floats(-0.15, 0.15), st.floats(-0.15, 0.15), st.floats(-3, 3), st.floats(0.02, 0.1))
def test_the_share_is_that_of_the_area(x: float, y: float, yaw: float, gap: float) -> None:
    """Against the exact area of the patch minus the surfaces grown by the bound."""
    rings = [rectangle((-1, 0), (-1, 1)), rectangle((gap, 1), (-1, 0.05))]
    patches = ground(*rings)
    contact = sole(x, y, yaw=yaw)
    list(patches.violations(contact, 0))
    patch = Polygon([point[:2] for point in contact.points])
    grown = [Polygon(ring).buffer(0.003) for ring in rings]
    wanted = patch.difference(grown[0].union(grown[1])).area / patch.area
    assert patches.unsupported == pytest.approx(wanted, abs=0.03)
