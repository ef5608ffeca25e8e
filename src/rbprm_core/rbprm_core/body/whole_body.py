"""Queries of the whole robot in one scene: kinematics, centre of mass, statics and collision."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
import pinocchio as pin

from rbprm_core.arrays import Array
from rbprm_core.body.collision import CollisionModel
from rbprm_core.body.contact import Contact
from rbprm_core.body.stability import Stability
from rbprm_core.body.state import State
from rbprm_core.budget import Budget
from rbprm_core.counters import Counters
from rbprm_core.robot.data import RobotData
from rbprm_core.robot.projection import project, project_with_base
from rbprm_core.scene import Scene
from rbprm_core.statics import GRIP_FORCE

MIN_MANIPULABILITY = 1e-6
"""Cubic metres; a manipulability (Tonneau et al. 2018, equation 17) that exceeds rounding."""


class WholeBody:
    """A robot in a scene. Not thread-safe: it holds scratch data.

    Args:
        data: the robot with its precomputed data.
        scene: the environment.
        gravity: (3,) gravity in the planning frame, m/s^2.
        threshold: b0 that the request asks of every state, newtons.
        grip_force: sum of the contact forces by which b0 without weight is measured, newtons.
        budget: polled while the collision tests are set up; None for no limit.

    Attributes:
        robot: the robot.
        scene: the environment.
        counters: counts and seconds of the queries.
        collision: collision tests of the robot in the scene.
        stability: robustness of contact sets.
    """

    def __init__(
        self,
        data: RobotData,
        scene: Scene,
        gravity: Array,
        threshold: float,
        grip_force: float = GRIP_FORCE,
        budget: Budget | None = None,
    ) -> None:
        self.robot, self.scene = data.robot, scene
        self.counters = Counters()
        self.stability = Stability(data.robot.mass, gravity, grip_force, threshold)
        self.collision = CollisionModel(data, scene, budget)
        self._data = self.robot.model.createData()
        self._surface_bound = [
            float(own.manipulability.max()) < MIN_MANIPULABILITY for own in data.databases
        ]

    @property
    def min_robustness(self) -> float:
        """b0 that every state must reach, newtons."""
        return self.stability.min_robustness

    def moves_on_surface_only(self, limb: int) -> bool:
        """True where the joints of a limb move its contact on a surface only.

        A knee's contact moves on a sphere about the hip: the root then cannot move freely while
        the contact is kept.

        Args:
            limb: index of the limb.
        """
        return self._surface_bound[limb]

    def base(self, q: Array, limb: int) -> pin.SE3:
        """Placement of the base joint of a limb in the planning frame, valid until the next query.

        Args:
            q: (nq,) configuration.
            limb: index of the limb.
        """
        pin.forwardKinematics(self.robot.model, self._data, q)
        return self._data.oMi[self.robot.limbs[limb].base]

    def com(self, q: Array) -> Array:
        """Centre of mass (3,) in the planning frame, metres.

        Args:
            q: (nq,) configuration.
        """
        return np.asarray(pin.centerOfMass(self.robot.model, self._data, q, False)).copy()

    def b0(self, contacts: Sequence[Contact], com: Array) -> float:
        """Robustness b0 of a contact set, newtons; minus infinity of an empty one.

        Args:
            contacts: the contacts that carry forces.
            com: (3,) centre of mass in the planning frame, metres.
        """
        with self.counters.timed("statics"):
            return self.stability.b0(contacts, com)

    def robustness(self, q: Array, contacts: Sequence[Contact]) -> float:
        """Robustness b0 of a configuration on some contacts, newtons.

        Args:
            q: (nq,) configuration.
            contacts: the contacts that carry forces.
        """
        return self.b0(contacts, self.com(q))

    def state(self, q: Array, contacts: Sequence[Contact], robustness: float) -> State:
        """The state of a configuration whose robustness is known.

        Args:
            q: (nq,) configuration.
            contacts: contacts, in the order in which they were made.
            robustness: raw b0, newtons.
        """
        return State(q, tuple(contacts), self.com(q), robustness)

    def limb_is_free(
        self, q: Array, limb: int, normal: Array | None, ignored: Iterable[int] = ()
    ) -> bool:
        """True where a limb is free of collision with the environment and the rest of the robot.

        Args:
            q: (nq,) configuration.
            limb: index of the limb.
            normal: (3,) normal of the surface that the limb touches, None where it touches none.
            ignored: indices of limbs that are not tested against.
        """
        with self.counters.timed("collision"):
            return self.collision.limb_free(q, limb, normal, ignored)

    def project(self, q: Array, contact: Contact) -> Array | None:
        """The configuration (nq,) with a limb on its contact, None where it cannot reach it.

        The other joints and the root stay (Tonneau et al. 2018, section 4.2.1).

        Args:
            q: (nq,) configuration.
            contact: the contact of the limb.
        """
        limb = self.robot.limbs[contact.limb]
        base = self.base(q, contact.limb)
        target, rotation = limb.target(base, contact.position, contact.rotation)
        with self.counters.timed("projection"):
            joints = project(limb, q[limb.q_index], target, rotation)
        if joints is None or not limb.faces(joints, base.rotation.T @ contact.normal):
            return None
        moved = q.copy()
        moved[limb.q_index] = joints
        return moved

    def project_with_root(self, q: Array, contact: Contact, max_shift: float) -> Array | None:
        """The configuration (nq,) with a limb on its contact and the root shifted towards it.

        None where the limb cannot reach its contact.

        Args:
            q: (nq,) configuration.
            contact: the contact of the limb.
            max_shift: largest shift of the root, metres.
        """
        limb = self.robot.limbs[contact.limb]
        base = self.base(q, contact.limb)
        target, rotation = limb.target(base, contact.position, contact.rotation)
        with self.counters.timed("projection"):
            found = project_with_base(limb, q[limb.q_index], target, rotation, max_shift)
        if found is None or not limb.faces(found[0], base.rotation.T @ contact.normal):
            return None
        moved = q.copy()
        moved[limb.q_index] = found[0]
        moved[:3] += base.rotation @ found[1]
        return moved
