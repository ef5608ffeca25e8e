r"""Static joint torques: the smallest largest share of the effort limits that balances a state.

In static equilibrium the joint torques $\tau$ and the contact forces $f = \sum \beta_i g_i$,
$\beta \geq 0$, on the generators of the friction cones satisfy (Escande et al. 2013, equation 6)

$$h(q) = S^T \tau + J^T f$$

with the gravity term $h$ of all coordinates. The forces are not unique; the torque ratio of a state
is the optimum of

$$\min_{r, \beta \geq 0} r \quad \text{subject to} \quad h_b = J_b^T f, \quad
|h_j - J_j^T f| \leq r\, \tau^{max}_j.$$
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import daqp
import numpy as np
import pinocchio as pin
from scipy.optimize import linprog

from rbprm_core.arrays import Array
from rbprm_core.body.contact import Contact
from rbprm_core.robot import Robot

ROOT_DOF = 6
EQUALITY = 5  # sense of an equality constraint in DAQP
OPTIMAL = 1  # exit flag of DAQP


@dataclass(frozen=True, eq=False)
class TorqueBalance:
    """Forces and torques that balance a state at its smallest torque ratio.

    Attributes:
        ratio: largest share of a joint's effort limit; infinity where no forces balance the state.
        forces: (p, 3) force on each contact point in the planning frame, newtons, in the order of
            the contacts' points.
        torques: (n,) torques of the joints, newton metres, or newtons of prismatic joints.
        joint: name of the joint with the largest share.
    """

    ratio: float
    forces: Array
    torques: Array
    joint: str


class TorqueModel:
    """Static torques of one robot. Not thread-safe: it holds scratch data.

    Joints whose effort limit is zero or missing in the URDF are not limited.

    Args:
        robot: the robot.
        gravity: (3,) gravity in the planning frame, m/s^2.

    Attributes:
        limits: (n,) effort limits of the joints, infinity for none.
    """

    def __init__(self, robot: Robot, gravity: Array) -> None:
        self._robot, self._model = robot, robot.model.copy()
        self._model.gravity.linear = np.asarray(gravity, dtype=float)
        self._data = self._model.createData()
        weight = float(np.linalg.norm(robot.mass * self._model.gravity.linear))
        self._weight = weight if weight > 0.0 else 1.0
        effort = np.asarray(self._model.effortLimit)[ROOT_DOF:]
        self.limits = np.where((effort > 0) & (effort < 1e6), effort, np.inf)

    def balance(self, q: Array, contacts: Sequence[Contact]) -> TorqueBalance:
        """The forces on some contacts that balance a configuration at the smallest torque ratio.

        Args:
            q: (nq,) configuration, its limbs on the contacts.
            contacts: the contacts that carry forces.
        """
        return self._solve(q, contacts)[0]

    def balance_gradient(
        self, q: Array, contacts: Sequence[Contact]
    ) -> tuple[TorqueBalance, Array]:
        """The balance of a configuration, and the gradient (nv,) of its torque ratio.

        The forces stay as they are while the configuration moves; the gradient is zero where no
        forces balance the robot.

        Args:
            q: (nq,) configuration, its limbs on the contacts.
            contacts: the contacts that carry forces.
        """
        balance, multipliers = self._solve(q, contacts)
        if not np.isfinite(balance.ratio):
            return balance, np.zeros(self._model.nv)
        forces = self._joint_forces(q, contacts, balance.forces)
        derivative = pin.computeStaticTorqueDerivatives(self._model, self._data, q, forces)
        return balance, multipliers @ np.asarray(derivative)

    def _joint_forces(
        self, q: Array, contacts: Sequence[Contact], forces: Array
    ) -> pin.StdVec_Force:
        """Wrench of the contact forces on each joint, in the frame of the joint."""
        pin.forwardKinematics(self._model, self._data, q)
        wrenches = [pin.Force.Zero() for _ in range(self._model.njoints)]
        first = 0
        for contact in contacts:
            spot = self._robot.limbs[contact.limb].spots[contact.spot]
            joint = self._model.frames[spot.frame].parentJoint
            place = self._data.oMi[joint]
            for point in contact.points:
                force = place.rotation.T @ forces[first]
                wrenches[joint] += pin.Force(force, np.cross(place.actInv(point), force))
                first += 1
        result = pin.StdVec_Force()
        result.extend(wrenches)
        return result

    def _solve(self, q: Array, contacts: Sequence[Contact]) -> tuple[TorqueBalance, Array]:
        """The balance, and the multipliers (nv,) of the static torques in its linear program."""
        gravity, generators, rays = self._terms(q, contacts)
        scales = np.concatenate([np.full(ROOT_DOF, self._weight), self.limits])
        kept = np.isfinite(scales)
        solution, multipliers = _min_max_share(
            gravity[kept] / scales[kept], generators[kept] * (self._weight / scales[kept, None])
        )
        if solution is None:
            nothing = np.full(len(self.limits), np.nan)
            unknown = np.full((len(rays) // 4, 3), np.nan)
            return TorqueBalance(np.inf, unknown, nothing, ""), np.zeros(self._model.nv)
        beta = self._weight * solution[:-1]
        forces = (beta[:, None] * rays).reshape(-1, 4, 3).sum(axis=1)
        torques = gravity[ROOT_DOF:] - generators[ROOT_DOF:] @ beta
        shares = np.abs(torques) / self.limits
        worst = int(np.argmax(shares))
        balance = TorqueBalance(float(shares[worst]), forces, torques, self._joint_name(worst))
        scaled = np.zeros(self._model.nv)
        scaled[kept] = multipliers / scales[kept]
        return balance, scaled

    def _terms(self, q: Array, contacts: Sequence[Contact]) -> tuple[Array, Array, Array]:
        """Gravity term (nv,), wrenches of the generators (nv, 4 p), and the generators (4 p, 3)."""
        model, data = self._model, self._data
        gravity = np.asarray(pin.computeGeneralizedGravity(model, data, q)).copy()
        pin.computeJointJacobians(model, data, q)
        pin.updateFramePlacements(model, data)
        columns, rays = [], []
        for contact in contacts:
            spot = self._robot.limbs[contact.limb].spots[contact.spot]
            frame = data.oMf[spot.frame]
            jacobian = pin.getFrameJacobian(model, data, spot.frame, pin.LOCAL_WORLD_ALIGNED)
            for point, generators in zip(contact.points, contact.generators, strict=True):
                arm = pin.skew(point - frame.translation)
                at_point = jacobian[:3] - arm @ jacobian[3:]
                columns.append(at_point.T @ generators.T)
                rays.append(generators)
        if not columns:
            return gravity, np.zeros((model.nv, 0)), np.zeros((0, 3))
        return gravity, np.hstack(columns), np.concatenate(rays)

    def _joint_name(self, index: int) -> str:
        """Name of the joint with a velocity coordinate, the root's left out."""
        for joint in range(2, self._model.njoints):
            first = self._model.joints[joint].idx_v - ROOT_DOF
            if first <= index < first + self._model.joints[joint].nv:
                return str(self._model.names[joint])
        raise IndexError(index)


def _min_max_share(load: Array, wrenches: Array) -> tuple[Array | None, Array]:
    r"""The solution of $\min r$ with $|l_j - W_j \beta| \leq r$ and balance, and its multipliers.

    Args:
        load: (6 + n,) load on the root, then on the joints.
        wrenches: (6 + n, g) what a unit of each coefficient carries of it.

    Returns:
        The solution (g + 1,), the coefficients and then r, None where no coefficients balance the
        root; the multipliers (6 + n,) of the loads.
    """
    rows, count = wrenches.shape
    joints = rows - ROOT_DOF
    matrix = np.zeros((rows + joints, count + 1))
    matrix[:rows, :count], matrix[rows:, :count] = wrenches, wrenches[ROOT_DOF:]
    matrix[ROOT_DOF:rows, count], matrix[rows:, count] = 1.0, -1.0
    free = np.full(joints, np.inf)
    lower = np.concatenate([np.zeros(count + 1), load, -free])
    upper = np.concatenate([np.full(count + 1, np.inf), load[:ROOT_DOF], free, load[ROOT_DOF:]])
    sense = np.zeros(len(lower), dtype=np.int32)
    sense[count + 1 : count + 1 + ROOT_DOF] = EQUALITY
    cost = np.append(np.zeros(count), 1.0)
    solution, _, flag, info = daqp.solve(None, cost, matrix, upper, lower, sense)
    if flag == OPTIMAL:
        multipliers = -np.asarray(info["lam"])[count + 1 :]
    else:
        solution, multipliers = _by_highs(matrix, lower, upper, cost)
    multipliers[ROOT_DOF:rows] += multipliers[rows:]
    return solution, multipliers[:rows]


def _by_highs(matrix: Array, lower: Array, upper: Array, cost: Array) -> tuple[Array | None, Array]:
    """The solution by HiGHS, 50 times slower: for what DAQP does not solve, or calls infeasible."""
    size, joints = len(cost), len(matrix) // 2 - ROOT_DOF // 2
    rows = ROOT_DOF + joints
    lower, upper = lower[size:], upper[size:]
    found = linprog(
        cost,
        np.vstack([-matrix[ROOT_DOF:rows], matrix[rows:]]),
        np.concatenate([-lower[ROOT_DOF:rows], upper[rows:]]),
        matrix[:ROOT_DOF],
        lower[:ROOT_DOF],
        method="highs",
    )
    if found.x is None or found.status != 0:
        return None, np.zeros(len(matrix))
    below, above = np.split(np.asarray(found.ineqlin.marginals), 2)
    return np.asarray(found.x), np.concatenate([found.eqlin.marginals, -below, above])
