"""Space of root configurations: bounds, distance and interpolation."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rbprm_core.arrays import Array
from rbprm_core.errors import InvalidInput
from rbprm_core.guide.root import RootBounds, RootSpace
from rbprm_core.guide.root_space import ANGLE_WEIGHT, RootSegment, distance
from rbprm_core.placement import Placement

BOUNDS = RootBounds(np.array([-1.0, -2, 0]), np.array([1.0, 2, 3]), np.array([0.5, 0.3, 0.2]))
SPACE = RootSpace(BOUNDS, np.array([-0.4]), np.array([0.4]))


@st.composite
def roots(draw: st.DrawFn, turned: float = np.pi) -> Array:
    """Root configurations with one joint and a quaternion of either sign."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    axis = rng.normal(size=3)
    angle = draw(st.floats(0, turned))
    rotation = pin.exp3(angle * axis / np.linalg.norm(axis))
    quaternion = pin.Quaternion(rotation)
    quaternion.normalize()
    sign = draw(st.sampled_from([-1, 1]))
    return np.concatenate(
        [rng.uniform(-3, 3, 3), sign * quaternion.coeffs(), rng.uniform(-1, 1, 1)]
    )


def root(
    position: tuple[float, float, float] = (0, 0, 1),
    yaw: float = 0,
    pitch: float = 0,
    roll: float = 0,
    joint: float = 0,
) -> Array:
    rotation = pin.Quaternion(pin.rpy.rpyToMatrix(roll, pitch, yaw))
    return np.concatenate([position, rotation.coeffs(), [joint]])


@given(roots(), roots())
def test_the_ends_of_an_interpolation_are_exact(a: Array, b: Array) -> None:
    for t, end in ((0.0, a), (1.0, b)):
        found = RootSegment(a, b).at(t)
        assert found[[0, 1, 2, 7]] == pytest.approx(end[[0, 1, 2, 7]], abs=1e-12)
        assert abs(found[3:7] @ end[3:7]) == pytest.approx(1, abs=1e-12)


@given(roots(), roots(), st.floats(0, 1))
def test_between_the_ends(a: Array, b: Array, t: float) -> None:
    before = a.copy(), b.copy()
    found = RootSegment(a, b).at(t)
    assert np.linalg.norm(found[3:7]) == pytest.approx(1, abs=1e-12)
    assert found[:3] == pytest.approx(a[:3] + t * (b[:3] - a[:3]))
    whole = float(distance(a, b))
    assert RootSegment(a, b).length == pytest.approx(whole, abs=1e-12)
    assert float(distance(a, found)) == pytest.approx(t * whole, abs=1e-6)
    assert float(distance(found, b)) == pytest.approx((1 - t) * whole, abs=1e-6)
    assert np.array_equal(a, before[0])
    assert np.array_equal(b, before[1])


@given(roots(turned=1e-7), st.floats(0, 1))
def test_tiny_rotations_are_interpolated_too(a: Array, t: float) -> None:
    b = root()
    found = RootSegment(a, b).at(t)
    assert float(distance(a, found)) == pytest.approx(t * float(distance(a, b)), abs=1e-9)


@given(roots(), roots(), roots())
def test_the_distance_is_a_metric(a: Array, b: Array, c: Array) -> None:
    assert float(distance(a, a)) == 0
    assert float(distance(a, b)) == pytest.approx(float(distance(b, a)))
    assert float(distance(a, c)) <= float(distance(a, b)) + float(distance(b, c)) + 1e-9
    assert distance(np.stack([a, c]), b) == pytest.approx(
        [float(distance(a, b)), float(distance(c, b))]
    )


@given(roots(), roots())
def test_the_sign_of_a_quaternion_does_not_count(a: Array, b: Array) -> None:
    flipped = b.copy()
    flipped[3:7] *= -1
    assert float(distance(b, flipped)) == pytest.approx(0, abs=1e-12)
    assert float(distance(a, flipped)) == pytest.approx(float(distance(a, b)))


@given(roots(), st.floats(0, np.pi), st.integers(0, 2))
def test_a_rotation_counts_by_its_angle(a: Array, angle: float, axis: int) -> None:
    rotation = pin.Quaternion(a[3:7]).matrix() @ pin.exp3(angle * np.eye(3)[axis])
    b = a.copy()
    b[3:7] = pin.Quaternion(rotation).coeffs()
    assert float(distance(a, b)) == pytest.approx(ANGLE_WEIGHT * angle, abs=1e-6)


@given(
    st.floats(-1, 1), st.floats(-2, 2), st.floats(0, 3),
    st.floats(-0.5, 0.5), st.floats(-0.3, 0.3), st.floats(-0.2, 0.2), st.floats(-0.4, 0.4),
)  # fmt: skip
def test_what_is_inside(
    x: float, y: float, z: float, yaw: float, pitch: float, roll: float, joint: float
) -> None:
    inside = root((x, y, z), yaw, pitch, roll, joint)
    assert SPACE.outside(inside) == ""
    assert SPACE.contains(inside)


@pytest.mark.parametrize(
    ("outside", "name"),
    [
        (root((1.1, 0, 1)), "x = 1.1"),
        (root((0, -2.1, 1)), "y = -2.1"),
        (root((0, 0, -0.1)), "z = -0.1"),
        (root(yaw=-0.6), "yaw"),
        (root(pitch=0.4), "pitch"),
        (root(roll=0.3), "roll"),
        (root(joint=0.5), "joints"),
    ],
)
def test_what_is_outside_and_why(outside: Array, name: str) -> None:
    assert not SPACE.contains(outside)
    assert name in SPACE.outside(outside)


def test_a_requested_root_outside_is_invalid_input() -> None:
    pose = Placement.parse((0, 0, 9))
    with pytest.raises(InvalidInput, match="z = 9 m is outside") as caught:
        SPACE.require(root((0, 0, 9)), pose, "goal")
    assert caught.value.field == "goal"
    assert caught.value.value == [0, 0, 9, 0, 0, 0, 1]
    SPACE.require(root((0, 0, 2)), pose, "goal")


HALF_RANGES = (0.0, 0.05, 0.3, 0.8, 1.5, 1.6, 2.5, 3.2)


@settings(max_examples=300)
@given(st.integers(0, 2**32 - 1), *[st.sampled_from(HALF_RANGES)] * 3)
def test_an_edge_keeps_its_bounds_exactly_where_all_its_points_do(
    seed: int, yaw: float, pitch: float, roll: float
) -> None:
    rng = np.random.default_rng(seed)
    half = np.array([yaw, pitch, roll])
    space = RootSpace(RootBounds(-np.ones(3), np.ones(3), half), np.zeros(0), np.zeros(0))
    ends = []
    for _ in range(2):  # often on a bound, where an arc is most likely to break it
        share = np.clip(rng.uniform(-1.5, 1.5, 3), -1, 1)
        angles = share * np.minimum(half, [3.1, 1.5, 3.1])  # not unique at 90 degrees
        rotation = pin.rpy.rpyToMatrix(angles[2], angles[1], angles[0])
        ends.append(np.concatenate([rng.uniform(-1, 1, 3), pin.Quaternion(rotation).coeffs()]))
    points = RootSegment(*ends).at_all(np.arange(401) / 400)
    over = np.array([excess(point, half) for point in points])
    found = space.contains_segment(*ends)
    assert not (found and over.max() > 2e-6)
    assert found or over.max() > -1e-3  # a bound may be broken between two of the points


def excess(point: Array, half: Array) -> float:
    """Largest excess of yaw, pitch and roll over their bounds, rad."""
    angles = np.abs(pin.rpy.matrixToRpy(pin.Quaternion(point[3:7]).matrix())[::-1])
    return float((angles - half).max())


def test_an_arc_may_leave_bounds_that_its_ends_keep() -> None:
    """Between two orientations that combine pitch and roll without yaw, the root yaws."""
    half = np.array([0.01, 1.5, 1.5])
    space = RootSpace(RootBounds(-np.ones(3), np.ones(3), half), np.zeros(0), np.zeros(0))
    a, b = (root((0, 0, 0), pitch=p, roll=r)[:7] for p, r in ((0.9, 0.9), (-0.9, -0.9)))
    assert space.contains(a)
    assert space.contains(b)
    assert not space.contains(RootSegment(a, b).at(0.5))
    assert not space.contains_segment(a, b)


def test_an_edge_with_an_end_outside_is_outside() -> None:
    inside, beside, turned = root(), root((2, 0, 1)), root(joint=0.5)
    assert SPACE.contains_segment(inside, inside)
    for other in (beside, turned):
        assert not SPACE.contains_segment(inside, other)
        assert not SPACE.contains_segment(other, inside)


@given(roots(), roots())
def test_many_points_of_a_segment_equal_single_points(a: Array, b: Array) -> None:
    shares = np.array([0.0, 0.2, 0.7, 1.0])
    for t, found in zip(shares, RootSegment(a, b).at_all(shares), strict=True):
        assert found == pytest.approx(RootSegment(a, b).at(t), abs=1e-15)
