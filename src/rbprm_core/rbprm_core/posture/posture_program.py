"""A posture problem as a nonlinear program in the tangent space of the robot."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from rbprm_core.arrays import Array
from rbprm_core.body.contact import Contact
from rbprm_core.body.state import State
from rbprm_core.body.torques import TorqueModel
from rbprm_core.failures import Cause, Failure
from rbprm_core.posture.constraints.clearance import Clearance
from rbprm_core.posture.constraints.contact_pose import ContactPose
from rbprm_core.posture.constraints.equilibrium import EquilibriumOnContacts
from rbprm_core.posture.constraints.rows import Constraint, stacked
from rbprm_core.posture.constraints.surface_contact import ContactOnSurface
from rbprm_core.posture.constraints.torque import TorqueRatio
from rbprm_core.posture.coordinates import Coordinates
from rbprm_core.posture.criteria import ReferencePosture
from rbprm_core.posture.kinematics import Kinematics
from rbprm_core.posture.problem import PostureProblem
from rbprm_core.posture.protocol import PostureOptions, PostureSetting
from rbprm_core.posture.sqp import Linearisation

MIN_CURVATURE = 1e-6
"""Curvature added to the criterion, so that each step is unique."""


class PostureProgram:
    """Constraints and criterion of one posture problem.

    Distances and torques get rows only once a posture violates them: both are costly, and most
    postures satisfy them without.

    Args:
        setting: robot and scene.
        options: options of the generator.
        problem: the problem.
        start: (nq,) configuration from which the search starts.
        coordinates: moving coordinates of the robot.
        torques: static torques of the robot.
        data: scratch data of the robot's model.
    """

    def __init__(
        self,
        setting: PostureSetting,
        options: PostureOptions,
        problem: PostureProblem,
        start: Array,
        coordinates: Coordinates,
        torques: TorqueModel,
        data: pin.Data,
    ) -> None:
        self._setting, self._options, self._problem = setting, options, problem
        self._coordinates, self._torques, self._data = coordinates, torques, data
        body = setting.body
        self._criterion = problem.criterion or ReferencePosture(start)
        self._equilibrium = EquilibriumOnContacts(
            body.stability, problem.supporting, problem.min_robustness
        )
        self._placed = [
            ContactOnSurface(body.robot, free.limb, free.surface, free.piece, free.edge_margin)
            for free in problem.free_contacts
        ]
        self._constraints: list[Constraint] = [
            *(ContactPose(body.robot, contact) for contact in problem.contacts),
            *self._placed,
            self._equilibrium,
            *problem.tasks,
        ]
        self._clearance: Clearance | None = None
        self._limit: TorqueRatio | None = None
        self._failure = Failure.of(Cause.UNSPECIFIED)

    @property
    def failure(self) -> Failure:
        """The constraint that the last linearisation violates most."""
        return self._failure

    def linearise(self, point: Array) -> Linearisation:
        """See `NonlinearProgram.linearise`."""
        robot = self._setting.body.robot
        kinematics = Kinematics(robot, self._data, point)
        model = self._criterion.model(kinematics, self._coordinates)
        rows = [constraint.rows(kinematics) for constraint in self._constraints]
        violations = np.array([row.violation for row in rows])
        tolerances = np.array([constraint.tolerance for constraint in self._constraints])
        # The last cut bounds b0 with a margin; the bound itself is tested.
        k = self._constraints.index(self._equilibrium)
        violations[k] = self._equilibrium.shortfall
        shares = violations / tolerances
        worst = int(np.argmax(shares))
        self._failure = self._constraints[worst].failure(float(violations[worst]))
        joined, moving = stacked(rows, robot.model.nv), self._coordinates.moving
        low, high = self._coordinates.bounds(point, self._options.max_step)
        return Linearisation(
            matrix=joined.matrix[:, moving],
            lower=joined.lower,
            upper=joined.upper,
            low=low,
            high=high,
            gradient=model.gradient,
            hessian=model.hessian + MIN_CURVATURE * np.eye(len(moving)),
            violation=float(shares[worst]),
        )

    def moved(self, point: Array, step: Array) -> Array:
        """See `NonlinearProgram.moved`."""
        return self._coordinates.moved(point, step)

    def accepts(self, point: Array) -> bool:
        """See `NonlinearProgram.accepts`: collisions, then torques."""
        contacts = self._contacts(point)
        if not self._is_free(point, contacts):
            if self._clearance is None:
                setting, margin = self._setting, self._options.margin
                self._clearance = Clearance(setting.data, setting.scene, contacts, margin)
                self._constraints.append(self._clearance)
            self._failure = self._clearance.failure(0.0)
            return False
        limit = self._problem.max_torque_ratio
        if limit is None or self._limit is not None:
            return True
        supporting = self._problem.supporting
        if self._torques.balance(point, supporting).ratio <= limit:
            return True
        self._limit = TorqueRatio(self._torques, supporting, limit)
        self._constraints.append(self._limit)
        return False

    def state(self, point: Array) -> State:
        """The state at a point that satisfies the problem.

        Args:
            point: (nq,) configuration.
        """
        body = self._setting.body
        robustness = body.robustness(point, self._problem.supporting)
        return State(point, self._contacts(point), body.com(point), robustness)

    def _contacts(self, point: Array) -> tuple[Contact, ...]:
        """All contacts, the free ones as they are placed."""
        if not self._placed:
            return self._problem.contacts
        kinematics = Kinematics(self._setting.body.robot, self._data, point)
        return (*self._problem.contacts, *(free.contact(kinematics) for free in self._placed))

    def _is_free(self, point: Array, contacts: tuple[Contact, ...]) -> bool:
        body = self._setting.body
        if not body.collision.root_free(point):
            return False
        normals = {contact.limb: contact.normal for contact in contacts}
        limbs = range(len(body.robot.limbs))
        return all(body.collision.limb_free(point, k, normals.get(k)) for k in limbs)
