r"""Static equilibrium: robustness $b_0$ from the primal linear program, solved by HiGHS.

Forces act along the edges of the friction pyramids with coefficients $\beta$. With $G$ the wrenches
of unit forces and $w$ the wrench that balances the weight, Tonneau et al. 2018, equation (8), is

$b_0 = \max_{b, \beta} b$ subject to $G \beta = w$ and $\beta \geq b \mathbf{1}$

The planner solves the dual (9) of this program with another solver.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import linprog

from rbprm_core.arrays import Array
from rbprm_core.check.poses import angle_between, transform, unit
from rbprm_core.check.violation import Kind, Violation
from rbprm_core.errors import RbprmError
from rbprm_core.plan_record import ContactEntry, StateEntry, Vector3

SOLVER_SLACK = 1e-6
"""Tolerance on $b_0$, as a share of the weight, or of the grip force where there is no weight.

HiGHS holds constraints to 1e-7 in the scaled problem, whose forces are in weights and whose moments
are in weights times the extent of the contacts. The errors of a few constraints add up in $b_0$.
"""

AGREEMENT = 1e-3
"""Allowed difference between declared and recomputed $b_0$, as a share of the same force.

With contacts some decimetres apart, $b_0$ changes by this much if the centre of mass moves by 1 mm,
which is the bound on the declared centre of mass.
"""

FREE_AGREEMENT = 0.05
"""Additional allowed difference, as a share of $b_0$, where the plan does not fix the tangents."""

MIN_FRICTION = 1e-4
"""Smaller coefficients of friction are raised to this value.

Without friction, a floor that is level up to rounding could not hold a robot, and $b_0$ would
depend on the last digits of the normals.
"""

ALIGNED = np.deg2rad(1.0)
"""Angle in radians up to which the z axis of a contact's orientation counts as its normal."""

MIN_SPREAD = 1e-3
"""Smallest over largest singular value of the wrenches below which contacts lie on a line."""

INDEPENDENT = 1e-9
"""Singular values below this share of the largest one are rounding."""

BALANCED = 1e-6
"""Residual of the balance, as a share of the load, up to which it holds.

It is ten times the tolerance of HiGHS on a constraint.
"""

UNBOUNDED = 1e3
"""$b_0$, in weights, from which on it counts as unbounded (force closure)."""

LINPROG_OPTIMAL, LINPROG_INFEASIBLE = 0, 2  # status of SciPy's linprog


def weight(mass: float, gravity: Vector3) -> Array:
    """Return the weight (3,) of a mass, newtons, planning frame.

    Args:
        mass: mass, kilograms.
        gravity: (3,) acceleration of gravity, m/s^2, planning frame.
    """
    return mass * np.array(gravity, dtype=float)


def tangent(contact: ContactEntry) -> tuple[Array, bool]:
    """Return the unit tangent $t_1$ (3,) of a contact, and whether the plan fixes it.

    It is the x axis of the contact's orientation if the z axis is the normal, and arbitrary if not.

    Args:
        contact: contact of a state.
    """
    normal = unit(contact.normal)
    axes = transform(contact.position, contact.orientation, "contact").rotation
    fixed = angle_between(axes[:, 2], normal) < ALIGNED
    seed = axes[:, 0] if fixed else np.eye(3)[int(np.argmin(np.abs(normal)))]
    return unit(seed - (seed @ normal) * normal), fixed


def generators(normal: ArrayLike, tangent_1: ArrayLike, friction: float) -> Array:
    r"""Return the unit edges (4, 3) of a friction pyramid, $n \pm \mu t_1$ and $n \pm \mu t_2$.

    Args:
        normal: (3,) outward normal $n$ of the surface.
        tangent_1: (3,) unit tangent $t_1$; the other is $t_2 = n \times t_1$.
        friction: coefficient $\mu$ of Coulomb friction.
    """
    n, t1 = unit(normal), np.array(tangent_1, dtype=float)
    t2 = np.cross(n, t1)
    mu = max(friction, MIN_FRICTION)
    return np.array([unit(n + mu * t) for t in (t1, -t1, t2, -t2)])


def robustness(points: ArrayLike, edges: ArrayLike, com: ArrayLike, load: ArrayLike) -> float:
    """Return the robustness $b_0$ of contacts under a load, newtons (see the module).

    Args:
        points: (k, 3) points at which the edges act, metres, planning frame.
        edges: (k, 3) unit edges of friction pyramids, planning frame.
        com: (3,) centre of mass, metres, planning frame.
        load: (3,) weight, newtons, planning frame, not zero.

    Returns:
        $b_0$; negative or minus infinity where the contacts cannot hold the robot, infinity in
        force closure.

    Raises:
        RbprmError: the solver gave no answer.
    """
    arms = np.reshape(np.array(points, dtype=float), (-1, 3)) - np.array(com, dtype=float)
    forces = np.reshape(np.array(edges, dtype=float), (-1, 3))
    if not len(forces):
        return -np.inf
    scale = float(np.linalg.norm(load))
    extent = max(float(np.linalg.norm(arms, axis=1).max()), 1e-9)
    wrenches = np.vstack((forces.T, np.cross(arms, forces).T / extent))
    target = np.concatenate((-np.array(load, dtype=float) / scale, np.zeros(3)))
    return scale * _max_min_coefficient(wrenches, target)


def grip_robustness(points: ArrayLike, edges: ArrayLike, force: float) -> float:
    r"""Return the robustness $b_0$ of contacts without load, newtons.

    Without load, $b_0$ of `robustness` is 0 or unbounded. So the sum of the coefficients is fixed,
    which gives the min-weight metric of Li et al. 2023, in newtons:

    $b_0 = \max_{b, \beta} b$ subject to $G \beta = 0$, $\mathbf{1}^T \beta = F$ and
    $\beta \geq b \mathbf{1}$

    Args:
        points: (k, 3) points at which the edges act, metres, planning frame.
        edges: (k, 3) unit edges of friction pyramids, planning frame.
        force: grip force $F$, newtons.

    Returns:
        Positive exactly in force closure; 0 where forces balance but some wrench is not resisted;
        negative or minus infinity where no forces balance.

    Raises:
        RbprmError: the solver gave no answer.
    """
    arms = np.reshape(np.array(points, dtype=float), (-1, 3))
    forces = np.reshape(np.array(edges, dtype=float), (-1, 3))
    if not len(forces):
        return -np.inf
    arms = arms - (arms.min(axis=0) + arms.max(axis=0)) / 2
    extent = max(float(np.abs(arms).max()), 1e-9)
    wrenches = np.vstack((forces.T, np.cross(arms / extent, forces).T))
    balance = np.vstack((wrenches, np.ones(len(forces))))
    b0 = force * _max_min_coefficient(balance, np.append(np.zeros(6), 1.0))
    strengths = np.linalg.svd(wrenches, compute_uv=False)
    on_a_line = len(strengths) < 6 or strengths[-1] < MIN_SPREAD * strengths[0]
    return min(b0, 0.0) if on_a_line else b0


def _max_min_coefficient(wrenches: Array, target: Array) -> float:
    r"""Return the largest $b$ for which some $\beta \geq b \mathbf{1}$ solves $A \beta = t$.

    Args:
        wrenches: (n, k) matrix $A$.
        target: (n,) vector $t$, of the order of 1.

    Returns:
        The optimum; minus infinity where no $\beta$ solves the equations, infinity from `UNBOUNDED`
        on.

    Raises:
        RbprmError: the solver gave no answer.
    """
    # With independent rows of equal size HiGHS detects infeasible problems. Without, it can end
    # without an answer, as for forces across surfaces of very low friction.
    left, sizes, rows = np.linalg.svd(wrenches, full_matrices=False)
    kept = sizes > INDEPENDENT * sizes[0]
    reduced = left.T @ target
    # Whether any coefficients, of either sign, balance is a question of linear algebra.
    if np.abs(target - left[:, kept] @ reduced[kept]).max() > BALANCED:
        return -np.inf
    rows, reduced = rows[kept], reduced[kept] / sizes[kept]
    count = wrenches.shape[1]
    # In the variables (s, b) with beta = b + s and s >= 0 there are no inequality rows.
    matrix = np.hstack((rows, rows.sum(axis=1, keepdims=True)))
    cost = np.append(np.zeros(count), -1.0)
    bounds = [(0.0, None)] * count + [(-UNBOUNDED, UNBOUNDED)]
    answer = linprog(cost, A_eq=matrix, b_eq=reduced, bounds=bounds, method="highs")
    if answer.status == LINPROG_INFEASIBLE:
        return -np.inf
    if answer.status != LINPROG_OPTIMAL:
        raise RbprmError(f"the solver of the equilibrium check failed: {answer.message}")
    best = float(answer.x[-1])
    return np.inf if best > 0.999 * UNBOUNDED else best


def state_robustness(
    contacts: Sequence[ContactEntry], com: ArrayLike, load: ArrayLike, grip_force: float = 1.0
) -> tuple[float, bool]:
    """Return the robustness $b_0$ of contacts in newtons, and whether the plan fixes all tangents.

    Args:
        contacts: contacts of a state.
        com: (3,) centre of mass, metres, planning frame.
        load: (3,) weight, newtons, planning frame. If it is zero, $b_0$ is that of the grip.
        grip_force: sum of the force coefficients where there is no weight, newtons.
    """
    points: list[Vector3] = []
    edges: list[Array] = []
    all_fixed = True
    for contact in contacts:
        t1, fixed = tangent(contact)
        all_fixed &= fixed
        pyramid = generators(contact.normal, t1, contact.friction)
        for point in contact.points:
            points += [point] * len(pyramid)
            edges.extend(pyramid)
    if not np.any(load):
        return grip_robustness(points, edges, grip_force), all_fixed
    return robustness(points, edges, com, load), all_fixed


def force_closure_violations(b0: float, index: int, grip_force: float) -> Iterator[Violation]:
    """Yield a violation if the contacts of a robot without weight do not resist every wrench.

    Args:
        b0: recomputed robustness, newtons.
        index: index of the state.
        grip_force: sum of the force coefficients, newtons.
    """
    if b0 < SOLVER_SLACK * grip_force:
        text = f"not in force closure: robustness b0 of {b0:.4g} N at a grip of {grip_force:.4g} N"
        yield Violation(index, "", Kind.STATICS, text)


def robustness_violations(
    state: StateEntry, index: int, b0: float, fixed: bool, threshold: float, scale: float
) -> Iterator[Violation]:
    """Yield violations if $b_0$ is below the threshold or differs from the declared one.

    Args:
        state: state of the plan.
        index: its index.
        b0: recomputed robustness, newtons.
        fixed: whether the plan fixes the tangents of all contacts.
        threshold: smallest allowed robustness, newtons.
        scale: weight of the robot, or the grip force if it has no weight, newtons.
    """
    if b0 < threshold - SOLVER_SLACK * scale:
        text = f"robustness b0 of {b0:.4g} N (at least {threshold:.4g} N)"
        yield Violation(index, "", Kind.STATICS, text)
    allowed = AGREEMENT * scale + (0.0 if fixed else FREE_AGREEMENT * abs(b0))
    if np.isfinite(b0) and abs(b0 - state.robustness) > allowed:
        text = f"declared robustness of {state.robustness:.4g} N, recomputed {b0:.4g} N"
        text += f" (must agree within {allowed:.2g} N)"
        yield Violation(index, "", Kind.ROBUSTNESS, text)
