"""Static equilibrium: b0 of the robust linear programme, in its primal form.

Source: Tonneau, Del Prete, Pettré, Park, Manocha, Mansard, "An efficient acyclic contact planner
for multiped robots", IEEE T-RO 2018, eq. (8).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import linprog

from rbprm_core.check.poses import angle_between, transform, unit
from rbprm_core.check.report import Kind, Violation
from rbprm_core.errors import RbprmError
from rbprm_core.plan_record import ContactEntry, StateEntry, Vector3

SOLVER_SLACK = 1e-6
"""Of the weight, or of the grip force where there is no weight. HiGHS holds constraints to 1e-7 in
the scaled problem, whose forces are in weights and whose moments in weights times the support's
extent; a few of them add up in b0."""

AGREEMENT = 1e-3
"""Of the weight: what 1 mm of the centre of mass, which the plan may be off by, moves b0 by at a
support of some decimetres. Of the grip force where there is no weight."""

FREE_AGREEMENT = 0.05
"""Of b0, on top, where the plan does not fix the pyramid's edges about the normal."""

MIN_FRICTION = 1e-4
"""Less friction counts as this much: without any, a floor that is level but for rounding would hold
nothing, and b0 would say more of the last digits of the normals than of the contacts."""

ALIGNED = np.deg2rad(1.0)
MIN_SPREAD = 1e-3
"""Of the largest singular value of the wrenches; contacts whose least is below it lie on a line."""

INDEPENDENT = 1e-9
"""Of the largest singular value of the wrenches; combinations of rows below it are rounding."""

BALANCED = 1e-6
"""Of the load: a residual that is none, ten times what HiGHS allows a constraint."""

UNBOUNDED = 1e3
"""b0 in weights from which on internal forces alone raise it without end (force closure)."""


def weight(mass: float, gravity: Vector3) -> NDArray[np.float64]:
    """Weight (3,) of a mass in kilograms, newtons, planning frame."""
    return mass * np.array(gravity, dtype=float)


def tangent(contact: ContactEntry) -> tuple[NDArray[np.float64], bool]:
    """Unit tangent t1 (3,) of a contact, and whether the plan fixes it.

    It is the x axis of the contact's orientation, where the z axis is the normal; else any.
    """
    normal = unit(contact.normal)
    axes = transform(contact.position, contact.orientation, "contact").rotation
    fixed = angle_between(axes[:, 2], normal) < ALIGNED
    seed = axes[:, 0] if fixed else np.eye(3)[int(np.argmin(np.abs(normal)))]
    return unit(seed - (seed @ normal) * normal), fixed


def generators(normal: ArrayLike, tangent_1: ArrayLike, friction: float) -> NDArray[np.float64]:
    """Unit edges (4, 3) of the friction pyramid n ± mu t1, n ± mu t2."""
    n, t1 = unit(normal), np.array(tangent_1, dtype=float)
    t2 = np.cross(n, t1)
    mu = max(friction, MIN_FRICTION)
    return np.array([unit(n + mu * t) for t in (t1, -t1, t2, -t2)])


def robustness(points: ArrayLike, edges: ArrayLike, com: ArrayLike, load: ArrayLike) -> float:
    """b0 of the robust programme: max b0 with the forces balancing the load, each at least b0.

    Args:
        points: where the edges apply (k, 3), metres.
        edges: unit generators (k, 3), one non-negative force each.
        com: centre of mass (3,), metres, in the same frame.
        load: weight (3,), newtons, not zero.

    Returns:
        b0 in newtons; negative or -inf where contacts cannot hold the robot, inf in force closure.
    """
    arms = np.reshape(np.array(points, dtype=float), (-1, 3)) - np.array(com, dtype=float)
    forces = np.reshape(np.array(edges, dtype=float), (-1, 3))
    if not len(forces):
        return -np.inf
    scale = float(np.linalg.norm(load))
    extent = max(float(np.linalg.norm(arms, axis=1).max()), 1e-9)
    wrenches = np.vstack((forces.T, np.cross(arms, forces).T / extent))
    target = np.concatenate((-np.array(load, dtype=float) / scale, np.zeros(3)))
    return scale * _largest_least_force(wrenches, target)


def grip(points: ArrayLike, edges: ArrayLike, force: float) -> float:
    """b0 without weight: as `robustness`, with no load and forces that add up to a grip force.

    Without a load either no force at all balances or b0 has no bound, so the forces' sum is fixed:
    the min-weight metric of Li, Culbertson, Burdick and Ames, "FRoGGeR", IROS 2023, in newtons.

    Args:
        points: where the edges apply (k, 3), metres.
        edges: unit generators (k, 3), one non-negative force each.
        force: sum of the forces, newtons.

    Returns:
        b0 in newtons: positive exactly in force closure; 0 where forces balance but some wrench is
        not resisted; negative or -inf where none balance.
    """
    arms = np.reshape(np.array(points, dtype=float), (-1, 3))
    forces = np.reshape(np.array(edges, dtype=float), (-1, 3))
    if not len(forces):
        return -np.inf
    arms = arms - (arms.min(axis=0) + arms.max(axis=0)) / 2
    extent = max(float(np.abs(arms).max()), 1e-9)
    wrenches = np.vstack((forces.T, np.cross(arms / extent, forces).T))
    balance = np.vstack((wrenches, np.ones(len(forces))))
    b0 = force * _largest_least_force(balance, np.append(np.zeros(6), 1.0))
    strengths = np.linalg.svd(wrenches, compute_uv=False)
    on_a_line = len(strengths) < 6 or strengths[-1] < MIN_SPREAD * strengths[0]
    return min(b0, 0.0) if on_a_line else b0


def _largest_least_force(wrenches: NDArray[np.float64], target: NDArray[np.float64]) -> float:
    """Max b0 s.t. wrenches (n, k) @ beta = target (n,), beta >= b0; target of the order of 1."""
    # In independent rows of one size HiGHS tells what has no solution; in rows as they come, as of
    # forces across surfaces of hardly any friction, it can end without an answer.
    left, sizes, rows = np.linalg.svd(wrenches, full_matrices=False)
    kept = sizes > INDEPENDENT * sizes[0]
    reduced = left.T @ target
    # Forces of either sign that balance exist or not by linear algebra.
    if np.abs(target - left[:, kept] @ reduced[kept]).max() > BALANCED:
        return -np.inf
    rows, reduced = rows[kept], reduced[kept] / sizes[kept]
    count = wrenches.shape[1]
    # With beta = b0 + s the programme is over (s >= 0, b0), and needs no inequality rows.
    matrix = np.hstack((rows, rows.sum(axis=1, keepdims=True)))
    cost = np.append(np.zeros(count), -1.0)
    bounds = [(0.0, None)] * count + [(-UNBOUNDED, UNBOUNDED)]
    answer = linprog(cost, A_eq=matrix, b_eq=reduced, bounds=bounds, method="highs")
    if answer.status == 2:
        return -np.inf
    if answer.status != 0:
        raise RbprmError(f"the solver of the static check failed: {answer.message}")
    best = float(answer.x[-1])
    return np.inf if best > 0.999 * UNBOUNDED else best


def state_robustness(
    contacts: Sequence[ContactEntry], com: ArrayLike, load: ArrayLike, grip_force: float = 1.0
) -> tuple[float, bool]:
    """b0 of a state in newtons, without load that of the grip; whether every pyramid is fixed."""
    points: list[Vector3] = []
    edges: list[NDArray[np.float64]] = []
    all_fixed = True
    for contact in contacts:
        t1, fixed = tangent(contact)
        all_fixed &= fixed
        pyramid = generators(contact.normal, t1, contact.friction)
        for point in contact.points:
            points += [point] * len(pyramid)
            edges.extend(pyramid)
    if not np.any(load):
        return grip(points, edges, grip_force), all_fixed
    return robustness(points, edges, com, load), all_fixed


def force_closure(b0: float, index: int, grip_force: float) -> Iterator[Violation]:
    """A state without weight whose contacts do not resist every wrench; newtons."""
    if b0 < SOLVER_SLACK * grip_force:
        text = f"not in force closure: robustness b0 of {b0:.4g} N at a grip of {grip_force:.4g} N"
        yield Violation(index, "", Kind.STATICS, text)


def statics(
    state: StateEntry, index: int, b0: float, fixed: bool, threshold: float, scale: float
) -> Iterator[Violation]:
    """A state below the threshold, or whose declared robustness is another; newtons.

    Args:
        scale: the robot's weight, or the grip force where it has none.
    """
    if b0 < threshold - SOLVER_SLACK * scale:
        text = f"robustness b0 of {b0:.4g} N (at least {threshold:.4g} N)"
        yield Violation(index, "", Kind.STATICS, text)
    allowed = AGREEMENT * scale + (0.0 if fixed else FREE_AGREEMENT * abs(b0))
    if np.isfinite(b0) and abs(b0 - state.robustness) > allowed:
        text = f"declared robustness of {state.robustness:.4g} N, recomputed {b0:.4g} N"
        text += f" (within {allowed:.2g} N)"
        yield Violation(index, "", Kind.ROBUSTNESS, text)
