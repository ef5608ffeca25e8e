"""Neighbouring states: what breaks, is made, moves or is kept; the two ends of the plan."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
import pinocchio as pin

from rbprm_core.check.poses import angle_between, pose_transform
from rbprm_core.check.report import Kind, Violation
from rbprm_core.plan_record import ContactEntry, ContactPlan, Pose, StateEntry

DRIFT_BOUND = 1.5e-3
TURN_BOUND = np.deg2rad(3.0)  # as near as a normal must be to its facet's
SLACK = 1e-9  # rounding of numbers that were compared with the same bound before


def limbs_once(state: StateEntry, index: int) -> Iterator[Violation]:
    """Limbs with more than one contact."""
    limbs = [contact.limb for contact in state.contacts]
    for limb in sorted({name for name in limbs if limbs.count(name) > 1}):
        text = f"has {limbs.count(limb)} contacts (at most 1)"
        yield Violation(index, limb, Kind.LIMB_TWICE, text)


@dataclass
class Tracker:
    """Follows every limb's contact from where it was made.

    A contact is kept between neighbours if its limb, frame, type and surface stay and neither a
    point nor the normal moves by more than its bound; else it has moved. A kept contact is held
    against the state in which it was made, so that many small steps do not add up unseen. Of a
    limb with more than one contact the first counts.

    Attributes:
        made: the contact of every limb as it was when it was made.
        before: contacts of the last state by limb; None before the first.
        changed: limbs that changed their contact in the last step.
        transitions: number of steps in which one did.
    """

    made: dict[str, ContactEntry] = field(default_factory=dict)
    before: dict[str, ContactEntry] | None = None
    changed: list[str] = field(default_factory=list)
    transitions: int = 0

    def step(self, state: StateEntry, index: int) -> Iterator[Violation]:
        """Violations of the pair of the last state and this one; makes this one the last."""
        after = _by_limb(state)
        before = after if self.before is None else self.before
        changed = _changed(before, after)
        self.changed = changed
        self.transitions += bool(changed)
        if len(changed) > 1:
            text = f"{len(changed)} limbs change their contact: {', '.join(changed)} (at most 1)"
            yield Violation(index, "", Kind.CHANGES, text)
        self.made = {
            limb: contact if limb in changed else self.made.get(limb, contact)
            for limb, contact in after.items()
        }
        for limb in sorted(after.keys() - set(changed)):
            yield from self._kept(limb, before[limb], after[limb], index)
        self.before = after

    def _kept(
        self, limb: str, before: ContactEntry, after: ContactEntry, index: int
    ) -> Iterator[Violation]:
        if before.friction != after.friction:
            text = f"kept contact's friction goes from {before.friction:g} to {after.friction:g}"
            yield Violation(index, limb, Kind.KEPT_FRICTION, text)
        drift = displacement(self.made[limb], after)
        turn = angle_between(self.made[limb].normal, after.normal)
        if drift > DRIFT_BOUND + SLACK or turn > TURN_BOUND + SLACK:
            text = f"kept contact has drifted by {1e3 * drift:.1f} mm, {np.rad2deg(turn):.2f} deg"
            text += f" (at most {1e3 * DRIFT_BOUND:.1f} mm, {np.rad2deg(TURN_BOUND):.2f} deg)"
            yield Violation(index, limb, Kind.DRIFT, text)
            self.made[limb] = after  # one report a drift, not one for each state after it


def displacement(before: ContactEntry, after: ContactEntry) -> float:
    """Farthest that the position or a point of a contact moved, metres; inf for other points."""
    if len(before.points) != len(after.points):
        return np.inf
    old = np.array([before.position, *before.points])
    new = np.array([after.position, *after.points])
    return float(np.linalg.norm(new - old, axis=1).max())


def transitions(plan: ContactPlan) -> int:
    """Number of neighbouring states between which a contact breaks, is made or moves."""
    states = [_by_limb(state) for state in plan.states]
    return sum(bool(_changed(before, after)) for before, after in pairwise(states))


def _by_limb(state: StateEntry) -> dict[str, ContactEntry]:
    """Contacts of a state by limb; of a limb with more than one the first."""
    return {contact.limb: contact for contact in reversed(state.contacts)}


def _changed(before: dict[str, ContactEntry], after: dict[str, ContactEntry]) -> list[str]:
    """Limbs whose contacts differ."""
    return sorted(limb for limb in before.keys() | after if _changes(limb, before, after))


def _changes(limb: str, before: dict[str, ContactEntry], after: dict[str, ContactEntry]) -> bool:
    """Whether a limb breaks, makes or moves its contact."""
    old, new = before.get(limb), after.get(limb)
    if old is None or new is None:
        return True
    if (old.frame, old.type, old.surface) != (new.frame, new.type, new.surface):
        return True
    turn = angle_between(old.normal, new.normal)
    return displacement(old, new) > DRIFT_BOUND + SLACK or turn > TURN_BOUND + SLACK


def missing_at_goal(plan: ContactPlan) -> tuple[str, ...]:
    """Limbs that were to be in contact in the last state and are not."""
    standing = {contact.limb for state in plan.states[-1:] for contact in state.contacts}
    return tuple(limb for limb in plan.request.goal_limbs or () if limb not in standing)


def ends(plan: ContactPlan) -> Iterator[Violation]:
    """First root away from the start, last root away from the goal."""
    last = len(plan.states) - 1
    yield from _end(plan, 0, plan.request.start, Kind.START)
    yield from _end(plan, last, plan.request.goal, Kind.GOAL)


def _end(plan: ContactPlan, index: int, wanted: Pose, kind: Kind) -> Iterator[Violation]:
    root = pose_transform(plan.states[index].root, f"states.{index}.root")
    goal = pose_transform(wanted, f"request.{kind}")
    distance = float(np.linalg.norm(root.translation - goal.translation))
    angle = float(np.linalg.norm(pin.log3(root.rotation.T @ goal.rotation)))
    request = plan.request
    far = distance > request.position_tolerance + SLACK
    turned = angle > request.orientation_tolerance + SLACK
    if far or turned:
        text = f"root {1e3 * distance:.2f} mm and {angle:.2g} rad from the {kind} (at most"
        text += (
            f" {1e3 * request.position_tolerance:.2g} mm, {request.orientation_tolerance:.2g} rad)"
        )
        yield Violation(index, "", kind, text)
