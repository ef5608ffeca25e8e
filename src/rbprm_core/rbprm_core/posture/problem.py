"""Posture problems: what a whole-body configuration has to satisfy, and what it should be near.

Escande et al. 2013, section 6. A problem knows nothing of optimisation.
"""

from __future__ import annotations

from dataclasses import dataclass

from rbprm_core.body.contact import Contact
from rbprm_core.posture.constraints.rows import Constraint
from rbprm_core.posture.constraints.surface_contact import SurfaceContact
from rbprm_core.posture.criteria import Criterion


@dataclass(frozen=True, eq=False)
class PostureProblem:
    """Input of a posture generator.

    Attributes:
        contacts: contacts whose geometry the posture has to satisfy, each at its place.
        supporting: the contacts that carry the robot, a subset of `contacts`.
        min_robustness: smallest raw b0 on the supporting contacts, newtons; minus infinity where
            equilibrium does not count.
        free_contacts: contacts whose place on a surface is found; they carry nothing.
        max_torque_ratio: largest share of a joint's effort limit, None where torques do not count.
        tasks: further constraints, such as a link kept upright.
        criterion: what is minimised; None for any posture, found by short steps from the start.
    """

    contacts: tuple[Contact, ...]
    supporting: tuple[Contact, ...]
    min_robustness: float
    free_contacts: tuple[SurfaceContact, ...] = ()
    max_torque_ratio: float | None = None
    tasks: tuple[Constraint, ...] = ()
    criterion: Criterion | None = None
