"""Contacts on the environment: distance, normal and friction."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from rbprm_core.check.plan_environment import Environment
from rbprm_core.check.poses import angle_between
from rbprm_core.check.violation import Kind, Violation
from rbprm_core.plan_record import ContactEntry

DISTANCE_BOUND = 3e-3  # metres between a contact point and the environment
NORMAL_BOUND = np.deg2rad(3.0)  # radians between the normals of a contact and of a facet
FRICTION_SLACK = 1e-6  # a coefficient may have been stored in single precision


def placement_violations(
    environment: Environment, contact: ContactEntry, index: int
) -> Iterator[Violation]:
    """Yield violations of a contact off the environment, or with another normal than its facets.

    Every triangle within the bound of a contact point is a facet of that point; the normal has to
    agree with one of them.

    Args:
        environment: environment of the plan.
        contact: contact to check.
        index: index of its state.
    """
    max_distance, max_angle = 0.0, 0.0
    for point in np.array(contact.points).reshape(-1, 3):
        facets, _ = environment.distances(point, DISTANCE_BOUND)
        if len(facets):
            angles = [angle_between(n, contact.normal) for n in environment.normals[facets]]
            max_angle = max(max_angle, min(angles))
        else:
            max_distance = max(max_distance, environment.distance(point))
    if max_distance > DISTANCE_BOUND:
        text = f"contact point {1e3 * max_distance:.1f} mm from the environment"
        text += f" (at most {1e3 * DISTANCE_BOUND:.1f} mm)"
        yield Violation(index, contact.limb, Kind.OFF_ENVIRONMENT, text)
    if max_angle > NORMAL_BOUND:
        text = f"contact normal {np.rad2deg(max_angle):.2f} deg from the normal of every facet at"
        text += f" the contact (at most {np.rad2deg(NORMAL_BOUND):.2f} deg)"
        yield Violation(index, contact.limb, Kind.NORMAL, text)


def friction_violations(
    environment: Environment, contact: ContactEntry, index: int
) -> Iterator[Violation]:
    """Yield a violation if a contact has more friction than the environment declares there.

    Of several facets within the distance bound of a point, the one with most friction counts.

    Args:
        environment: environment of the plan.
        contact: contact to check.
        index: index of its state.
    """
    for point in np.array(contact.points).reshape(-1, 3):
        facets, _ = environment.distances(point, DISTANCE_BOUND)
        limit = environment.friction[facets].max(initial=0.0)
        if len(facets) and contact.friction > limit + FRICTION_SLACK:
            text = f"contact friction {contact.friction:g}"
            text += f" above the {limit:g} of the environment there"
            yield Violation(index, contact.limb, Kind.FRICTION, text)
            return
