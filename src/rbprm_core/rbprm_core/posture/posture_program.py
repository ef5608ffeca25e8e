"""A posture problem as a nonlinear program in the tangent space of the robot."""

from __future__ import annotations

import numpy as np

from rbprm_core.arrays import Array
from rbprm_core.body.contact import Contact
from rbprm_core.body.state import State
from rbprm_core.failures import Cause, Failure
from rbprm_core.posture.constraints.clearance import Clearance
from rbprm_core.posture.constraints.contact_pose import ContactPose
from rbprm_core.posture.constraints.equilibrium import EquilibriumOnContacts
from rbprm_core.posture.constraints.rows import Constraint, Rows, stacked
from rbprm_core.posture.constraints.surface_contact import ContactOnSurface
from rbprm_core.posture.constraints.torque import TorqueRatio
from rbprm_core.posture.criteria import ReferencePosture
from rbprm_core.posture.model import PostureModel
from rbprm_core.posture.problem import PostureProblem
from rbprm_core.posture.sqp import Linearisation

MIN_CURVATURE = 1e-6
"""Curvature added to the criterion, so that each step is unique."""


class PostureProgram:
    """Constraints and criterion of one posture problem.

    Distances and torques get rows only once a posture violates them: both are costly, and most
    postures satisfy them without.

    Args:
        model: the robot in its scene.
        problem: the problem.
        start: (nq,) configuration from which the search starts.
        margin: smallest distance between bodies that get rows, metres.

    Attributes:
        accepted: the state of the point that was accepted last, None before.
    """

    def __init__(
        self, model: PostureModel, problem: PostureProblem, start: Array, margin: float
    ) -> None:
        self._model, self._problem, self._margin = model, problem, margin
        self._criterion = problem.criterion or ReferencePosture(start)
        robot = model.robot
        self._equilibrium = EquilibriumOnContacts(
            model.stability, problem.supporting, problem.min_robustness
        )
        self._placed = [ContactOnSurface(robot, free) for free in problem.free_contacts]
        self._constraints: list[Constraint] = [
            *(ContactPose(robot, contact) for contact in problem.contacts),
            *self._placed,
            *([self._equilibrium] if problem.min_robustness > -np.inf else []),
            *problem.tasks,
        ]
        self._clearance: Clearance | None = None
        self._limit: TorqueRatio | None = None
        self._kinematics = model.kinematics(start)
        self._curvature = MIN_CURVATURE * np.eye(model.coordinates.size)
        self._violated: tuple[Constraint, float] | None = None
        self.accepted: State | None = None

    @property
    def failure(self) -> Failure:
        """The constraint that the last point violates most."""
        if self._violated is None:
            return Failure.of(Cause.UNSPECIFIED)
        constraint, violation = self._violated
        return constraint.failure(violation)

    def linearise(self, point: Array) -> Linearisation:
        """See `NonlinearProgram.linearise`."""
        coordinates = self._model.coordinates
        kinematics = self._kinematics = self._model.kinematics(point)
        model = self._criterion.model(kinematics, coordinates)
        rows = [constraint.rows(kinematics) for constraint in self._constraints]
        shares = [
            constraint.violation(row) / constraint.tolerance
            for constraint, row in zip(self._constraints, rows, strict=True)
        ]
        self._find_violated(rows, shares)
        joined, moving = stacked(rows, self._model.robot.model.nv), coordinates.moving
        low, high = coordinates.bounds(point)
        return Linearisation(
            matrix=joined.matrix[:, moving],
            lower=joined.lower,
            upper=joined.upper,
            low=low,
            high=high,
            gradient=model.gradient,
            hessian=model.hessian + self._curvature,
            violation=max(shares, default=0.0),
        )

    def moved(self, point: Array, step: Array) -> Array:
        """See `NonlinearProgram.moved`."""
        return self._model.coordinates.moved(point, step)

    def accepts(self, point: Array) -> bool:
        """See `NonlinearProgram.accepts`: collisions, then torques."""
        contacts = self._contacts()
        normals = {contact.limb: contact.normal for contact in contacts}
        if self._model.pairs.collide(self._kinematics.data, normals):
            if self._clearance is None:
                pairs = self._model.pairs
                self._clearance = Clearance(self._model.robot, pairs, contacts, self._margin)
                self._constraints.append(self._clearance)
            self._violated = self._clearance, 0.0
            return False
        limit, supporting = self._problem.max_torque_ratio, self._problem.supporting
        if limit is not None and self._limit is None:
            torques = TorqueRatio(self._model.torques, supporting, limit)
            if not torques.holds(point):
                self._limit = torques
                self._constraints.append(torques)
                self._violated = torques, 0.0
                return False
        com, robustness = self._kinematics.com, self._equilibrium.robustness
        if self._problem.min_robustness == -np.inf:
            robustness = self._model.stability.b0(supporting, com)
        self.accepted = State(point, contacts, com, robustness)
        return True

    def _contacts(self) -> tuple[Contact, ...]:
        """All contacts, the free ones as the last point places them."""
        placed = (free.contact(self._kinematics) for free in self._placed)
        return (*self._problem.contacts, *placed)

    def _find_violated(self, rows: list[Rows], shares: list[float]) -> None:
        """Find the violated constraint farthest from the point, in units of the coordinates."""
        distances = [
            row.distance if share > 1.0 else 0.0 for row, share in zip(rows, shares, strict=True)
        ]
        worst = int(np.argmax(distances)) if distances else 0
        if distances and distances[worst] > 0.0:
            constraint = self._constraints[worst]
            self._violated = constraint, constraint.violation(rows[worst])
