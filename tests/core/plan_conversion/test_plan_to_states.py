"""States from the entries of a plan, and from measurements with small errors."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from rbprm_core.body.state import State
from rbprm_core.contacts.along_guide.walk_state import WalkState, walk_state
from rbprm_core.errors import InvalidInput
from rbprm_core.outcome import Outcome
from rbprm_core.plan_conversion.plan_to_states import (
    StateFields,
    state_from_plan,
    states_from_plan,
)
from rbprm_core.plan_conversion.states_to_plan import state_entry
from rbprm_core.plan_record import ContactEntry, StateEntry
from rbprm_core.request import PlanRequest
from rbprm_core.robot import Robot
from rbprm_core.robot.data import RobotData
from rbprm_core.scene import Scene

Planned = tuple[RobotData, Scene, PlanRequest, Outcome]
NAN = float("nan")


def same(one: State, other: State) -> None:
    assert np.array_equal(one.q, other.q)
    assert one.robustness == other.robustness
    assert one.com == pytest.approx(other.com)
    assert [c.limb for c in one.contacts] == [c.limb for c in other.contacts]
    for a, b in zip(one.contacts, other.contacts, strict=True):
        assert (a.surface, a.friction) == (b.surface, b.friction)
        assert np.array_equal(a.position, b.position)
        assert np.abs(a.points - b.points).max() < 1e-12
        assert np.abs(a.generators - b.generators).max() < 1e-12


@pytest.mark.parametrize("name", ["climb", "trot"])
def test_a_plan_comes_back_from_its_words(name: str, request: pytest.FixtureRequest) -> None:
    data, scene, _, outcome = request.getfixturevalue(name)
    entries = [state_entry(data.robot, state) for state in outcome.states]
    back = states_from_plan(entries, data.robot)
    for entry, state, found in zip(entries, outcome.states, back, strict=True):
        same(found, state)
        same(state_from_plan(entry, data.robot, scene), state)


def test_ages_follow_from_the_states_before(trot: Planned) -> None:
    data, _, _, outcome = trot
    entries = [state_entry(data.robot, state) for state in outcome.states]
    shuffled = [
        entry.model_copy(update={"contacts": tuple(sorted(entry.contacts, key=lambda c: c.limb))})
        if i
        else entry
        for i, entry in enumerate(entries)
    ]
    back = states_from_plan(shuffled, data.robot)
    for i, (found, state) in enumerate(zip(back, outcome.states, strict=True)):
        ordered = walk_state(back[: i + 1], len(data.robot.limbs))
        assert isinstance(state, WalkState)
        assert ordered.free == state.free
        assert [c.limb for c in ordered.contacts] == [c.limb for c in state.contacts]
        assert [c.limb for c in found.contacts] == [c.limb for c in state.contacts]


def test_states_that_share_a_contact_share_the_object(climb: Planned) -> None:
    data, _, _, outcome = climb
    back = states_from_plan([state_entry(data.robot, s) for s in outcome.states], data.robot)
    shared = [{id(c) for c in a.contacts} & {id(c) for c in b.contacts} for a, b in pairwise(back)]
    assert all(shared)


def moved(entry: StateEntry, lift: float, lean: float) -> StateEntry:
    """The entry of a state whose root and contacts were measured with small errors."""
    turn = pin.Quaternion(pin.rpy.rpyToMatrix(lean, 0.0, 0.0))

    def off(contact: ContactEntry) -> ContactEntry:
        x, y, z = contact.position
        leaning = turn * pin.Quaternion(np.array(contact.orientation))
        return contact.model_copy(
            update={"position": (x, y, z + lift), "orientation": tuple(leaning.coeffs().tolist())}
        )

    x, y, z = entry.root.position
    root = entry.root.model_copy(update={"position": (x, y, z + lift)})
    return entry.model_copy(
        update={"root": root, "contacts": tuple(off(c) for c in entry.contacts)}
    )


@pytest.mark.parametrize("lift", [-0.006, 0.004])
def test_measured_contacts_are_laid_onto_their_surfaces(climb: Planned, lift: float) -> None:
    data, scene, _, outcome = climb
    state = outcome.states[len(outcome.states) // 2]
    found = state_from_plan(moved(state_entry(data.robot, state), lift, 0.02), data.robot, scene)
    scratch = data.robot.model.createData()
    pin.framesForwardKinematics(data.robot.model, scratch, found.q)
    for contact, planned in zip(found.contacts, state.contacts, strict=True):
        assert np.abs(contact.points[:, 2] - planned.points[:, 2]).max() < 1e-9
        assert contact.normal == pytest.approx(planned.normal)
        limb = data.robot.limbs[contact.limb]
        frame = scratch.oMf[limb.frame] * limb.contact
        assert np.abs(frame.translation - contact.position).max() < 1e-4
        assert np.abs(frame.rotation - contact.rotation).max() < 1e-3


def changed(entry: StateEntry, path: str, value: Any) -> StateEntry:
    """The entry of a state with one value replaced, of any type."""
    key, *rest = path.split(".")
    if not rest:
        return entry.model_copy(update={key: value})
    contacts = list(entry.contacts)
    contacts[int(rest[0])] = contacts[int(rest[0])].model_copy(update={rest[1]: value})
    return entry.model_copy(update={"contacts": tuple(contacts)})


@pytest.mark.parametrize(
    ("path", "value", "field"),
    [
        ("joints", (0.0, 0.0), "now.joints"),
        ("joints", (NAN,) * 32, "now.joints"),
        ("joints", (9.0,) * 32, "now.joints."),
        ("contacts.0.limb", "tail", "now.contacts.0.limb"),
        ("contacts.0.limb", "right_leg", "now.contacts."),
        ("contacts.1.surface", "moon", "now.contacts.1.surface"),
        ("contacts.1.surface", "riser", "now.contacts.1.position"),
        ("contacts.0.position", (0.0, 0.0, 5.0), "now.contacts.0.position"),
        ("contacts.0.position", (0.0, NAN, 0.0), "now.contacts.0.position"),
        ("contacts.0.orientation", (0.0, 0.0, 0.0, 0.0), "now.contacts.0.orientation"),
    ],
)
def test_bad_words_are_named(climb: Planned, path: str, value: Any, field: str) -> None:
    data, scene, _, outcome = climb
    entry = changed(state_entry(data.robot, outcome.states[0]), path, value)
    with pytest.raises(InvalidInput) as caught:
        state_from_plan(entry, data.robot, scene, "now")
    assert caught.value.field.startswith(field)


def test_a_limb_far_from_its_contact_is_refused(climb: Planned) -> None:
    data, scene, _, outcome = climb
    entry = state_entry(data.robot, outcome.states[0])
    x, y, z = entry.contacts[0].position
    entry = changed(entry, "contacts.0.position", (x - 0.2, y, z))
    with pytest.raises(InvalidInput, match=r"limb (left|right)_leg is"):
        state_from_plan(entry, data.robot, scene)


def test_any_surface_will_do_where_none_is_named(climb: Planned) -> None:
    data, scene, _, outcome = climb
    entry = changed(state_entry(data.robot, outcome.states[0]), "contacts.0.surface", "")
    assert state_from_plan(entry, data.robot, scene).contacts[0].surface == "ground"


def test_joints_a_little_beyond_their_limits_are_put_onto_them(climb: Planned) -> None:
    data, _, _, outcome = climb
    robot: Robot = data.robot
    entry = state_entry(robot, outcome.states[0])
    high = robot.high[7:]
    joints = (float(high[0]) + 0.01, *entry.joints[1:])
    assert state_from_plan(changed(entry, "joints", joints), robot, None).q[7] == high[0]


def test_fields_in_the_words_of_messages(trot: Planned) -> None:
    data, scene, _, outcome = trot
    entry = state_entry(data.robot, outcome.states[0])
    names = StateFields("joint_positions", "pose.position", "pose.orientation", "surface_id")
    for path, value, field in (
        ("joints", (), "joint_positions"),
        ("joints", (0.0, 0.0, 9.0, *entry.joints[3:]), "joint_positions.2"),
        ("contacts.1.position", (0.0, 0.0, 9.0), "contacts.1.pose.position"),
        ("contacts.1.orientation", (0.0, 0.0, 0.0, 0.0), "contacts.1.pose.orientation"),
        ("contacts.1.surface", "moon", "contacts.1.surface_id"),
        ("contacts.1.limb", "tail", "contacts.1.limb"),
    ):
        with pytest.raises(InvalidInput) as caught:
            state_from_plan(changed(entry, path, value), data.robot, scene, names=names)
        assert caught.value.field == f"state.{field}"
