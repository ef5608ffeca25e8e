"""Sequences: the one-change rule, FIFO order, and how a walk stops."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pinocchio as pin
import pytest
from numpy.typing import NDArray

from rbprm_core.body.state import State
from rbprm_core.budget import Budget, Progress
from rbprm_core.contacts.along_guide import (
    ContactGenerator,
    SequenceOptions,
    plan_sequence,
    start_state,
)
from rbprm_core.errors import Cancelled, NoSequenceFound, TimeLimitReached
from rbprm_core.failures import Cause
from rbprm_core.guide.root import GuidePath
from rbprm_core.outcome import Outcome
from rbprm_core.request import PlanRequest
from rbprm_core.robot import Robot
from rbprm_core.robot.data import RobotData
from rbprm_core.scene import Scene, Surface, make_surface

Array = NDArray[np.float64]
Box = Callable[..., list[Surface]]
GRAVITY = np.array([0.0, 0.0, -9.81])
THRESHOLD = 5.0
LEGS = (0, 1, 2, 3)
PLAIN = SequenceOptions()
KEPT = 1e-9  # metres: a contact that is kept is the same object's numbers


def straight(length: float, yaw: float = 0.0) -> GuidePath:
    turn = pin.Quaternion(pin.exp3(np.array([0, 0, yaw]))).coeffs()
    start = np.array([0, 0, 0.6, 0, 0, 0, 1.0])
    return GuidePath(np.array([start, [length, 0, 0.6, *turn]]))


def walk(
    generator: ContactGenerator,
    guide: GuidePath,
    seed: int = 0,
    budget: Budget | None = None,
    options: SequenceOptions = PLAIN,
    limbs: tuple[int, ...] = LEGS,
) -> list[State]:
    first = start_state(generator, guide.nodes[0], limbs)
    rng = np.random.default_rng(seed)
    return plan_sequence(generator, guide, first, budget or Budget(), rng, options)


def island(high: float) -> Scene:
    ring: list[list[float]] = [[-2, -2, 0], [high, -2, 0], [high, 2, 0], [-2, 2, 0]]
    return Scene([make_surface("island", ring, 0.5)])


@pytest.fixture(scope="module")
def flat(hyq_data: RobotData, flat_scene: Scene) -> ContactGenerator:
    return ContactGenerator(hyq_data, flat_scene, GRAVITY, THRESHOLD)


@pytest.fixture(scope="module")
def steps(flat: ContactGenerator) -> list[State]:
    """A metre and a half on flat ground, turning a little."""
    return walk(flat, straight(1.5, yaw=0.3))


@pytest.fixture(scope="module")
def sequences(
    steps: list[State], outcomes: dict[int, tuple[PlanRequest, Outcome]]
) -> dict[str, tuple[float, tuple[State, ...]]]:
    """Threshold and states of several walks."""
    found = {"flat": (THRESHOLD, tuple(steps))}
    for seed, (request, outcome) in outcomes.items():
        found[f"rubble {seed}"] = (request.robustness_threshold, outcome.states)
    return found


def moves(before: State, after: State) -> list[int]:
    """Limbs whose contact breaks, is made or moves."""
    changed = []
    for limb in LEGS:
        old, new = before.contact_of(limb), after.contact_of(limb)
        if old is None or new is None:
            moved = old is not new
        else:
            moved = np.abs(old.position - new.position).max() > KEPT
        if moved:
            changed.append(limb)
    return changed


def test_at_most_one_change_a_step(sequences: dict[str, tuple[float, tuple[State, ...]]]) -> None:
    for name, (_, states) in sequences.items():
        changes = [moves(a, b) for a, b in pairwise(states)]
        assert max(map(len, changes)) == 1, name
        assert {limb for change in changes for limb in change} == set(LEGS), name


def test_contacts_are_oldest_first(sequences: dict[str, tuple[float, tuple[State, ...]]]) -> None:
    for name, (_, states) in sequences.items():
        for before, after in pairwise(states):
            changed = moves(before, after)
            kept = [c.limb for c in before.contacts if c.limb not in changed]
            made = [limb for limb in changed if after.contact_of(limb) is not None]
            assert [c.limb for c in after.contacts] == kept + made, name


def test_every_limb_is_in_contact_or_free_and_once(
    sequences: dict[str, tuple[float, tuple[State, ...]]],
) -> None:
    for _, states in sequences.values():
        for state in states:
            limbs = [contact.limb for contact in state.contacts]
            assert sorted([*limbs, *state.free]) == list(LEGS)


def test_every_state_is_robust_enough(
    sequences: dict[str, tuple[float, tuple[State, ...]]],
) -> None:
    for threshold, states in sequences.values():
        assert min(state.robustness for state in states) >= threshold


def test_every_state_is_inside_the_limits_and_on_its_contacts(
    sequences: dict[str, tuple[float, tuple[State, ...]]], hyq: Robot
) -> None:
    data = hyq.model.createData()
    for _, states in sequences.values():
        for state in states:
            assert (state.q >= hyq.low).all()
            assert (state.q <= hyq.high).all()
            pin.framesForwardKinematics(hyq.model, data, state.q)
            for contact in state.contacts:
                limb = hyq.limbs[contact.limb]
                centre = data.oMf[limb.frame].act(limb.contact.translation)
                wanted = contact.position + limb.radius * contact.normal
                assert np.linalg.norm(centre - wanted) < 1e-4


def test_every_state_is_free_of_collision(steps: list[State], flat: ContactGenerator) -> None:
    for state in steps:
        assert flat.body.collision.root_free(state.q)
        for limb in LEGS:
            contact = state.contact_of(limb)
            normal = None if contact is None else contact.normal
            assert flat.body.collision.limb_free(state.q, limb, normal)


def unsupported(generator: ContactGenerator, states: list[State]) -> float:
    """Share of the transitions whose kept contacts hold the robot neither before nor after."""
    falls = []
    for before, after in pairwise(states):
        changed = moves(before, after)
        if changed:
            kept = [c for c in before.contacts if c.limb not in changed]
            falls.append(max(generator.body.robustness(s.q, kept) for s in (before, after)) < 0)
    return float(np.mean(falls))


def test_supported_transitions_are_preferred(flat: ContactGenerator) -> None:
    papers = SequenceOptions(prefer_supported=False)
    shares = [
        unsupported(flat, walk(flat, straight(3.0), options=options)) for options in (PLAIN, papers)
    ]
    assert shares[0] < 0.5 * shares[1]


def test_the_roots_follow_the_guide(steps: list[State]) -> None:
    guide = straight(1.5, yaw=0.3)
    assert np.array_equal(steps[0].q[:7], guide.nodes[0])
    assert steps[-1].q[:7] == pytest.approx(guide.nodes[-1])
    along = [state.q[0] for state in steps]
    assert along == sorted(along)
    assert np.diff(along).max() <= SequenceOptions().step + 1e-9
    arc_lengths = np.linspace(0, guide.length, 4000)
    places = np.array([guide.root(s) for s in arc_lengths])
    for state in steps:
        assert np.abs(places - state.q[:7]).max(axis=1).min() < 1e-3


def test_the_seed_decides_alone(flat: ContactGenerator, steps: list[State]) -> None:
    again = walk(flat, straight(1.5, yaw=0.3))
    assert all(np.array_equal(a.q, b.q) for a, b in zip(steps, again, strict=True))


def test_a_limb_that_is_free_at_the_start_is_put_down(flat: ContactGenerator) -> None:
    states = walk(flat, straight(0.4), limbs=(0, 1, 2))
    assert states[0].free == (3,)
    assert any(state.contact_of(3) is not None for state in states)
    assert max(len(moves(a, b)) for a, b in pairwise(states)) == 1


@pytest.mark.parametrize("step", [0.48, 0.52, 0.56])
def test_a_limb_is_not_put_down_in_the_step_that_breaks_another(
    hyq_data: RobotData, step: float
) -> None:
    """One leg is over a pit until the ground comes within its reach, while the others walk."""
    left = np.array([[-2, 0.25, 0], [4, 0.25, 0], [4, 2, 0], [-2, 2, 0]])
    right = np.array([[0.2, -2, 0], [4, -2, 0], [4, 0, 0], [0.2, 0, 0]])
    scene = Scene([make_surface("left", left, 0.5), make_surface("right", right, 0.5)])
    generator = ContactGenerator(hyq_data, scene, GRAVITY, -1e3)
    options = SequenceOptions(step=step, min_step=step, prefer_supported=False)
    states = walk(generator, straight(1.6), options=options, limbs=(0, 1, 2))
    assert max(len(moves(a, b)) for a, b in pairwise(states)) == 1
    assert any(a.free == b.free == (3,) and moves(a, b) for a, b in pairwise(states))
    assert states[-1].contact_of(3) is not None


def test_a_guide_without_length_is_the_start(flat: ContactGenerator) -> None:
    guide = straight(0.0)
    assert len(walk(flat, guide)) == 1


def test_the_papers_order_walks_too(flat: ContactGenerator) -> None:
    states = walk(flat, straight(1.0), options=SequenceOptions(prefer_supported=False))
    assert states[-1].q[0] == pytest.approx(1.0)
    assert max(len(moves(a, b)) for a, b in pairwise(states)) == 1


def test_where_the_ground_ends(hyq_data: RobotData) -> None:
    generator = ContactGenerator(hyq_data, island(1.0), GRAVITY, THRESHOLD)
    with pytest.raises(NoSequenceFound) as caught:
        walk(generator, straight(3.0))
    error = caught.value
    assert 0 < error.fraction < 1
    assert error.state == len(error.states) - 1
    assert error.states[-1].q[0] == pytest.approx(error.fraction * 3.0)
    assert error.states[-1].q[0] > 0.2
    assert error.limb in ("", *(limb.name for limb in hyq_data.robot.limbs))
    assert error.failure.cause != Cause.UNSPECIFIED
    assert f"state {error.state}" in str(error)
    for state in error.states:
        assert state.robustness >= THRESHOLD


def test_a_wall_across_the_guide(hyq_data: RobotData, flat_scene: Scene, make_box: Box) -> None:
    wall = make_box("wall", np.array([1.2, -3, 0.2]), np.array([1.4, 3, 2.0]))
    scene = flat_scene.edited(changed=wall)
    generator = ContactGenerator(hyq_data, scene, GRAVITY, THRESHOLD)
    with pytest.raises(NoSequenceFound) as caught:
        walk(generator, straight(3.0))
    assert caught.value.states[-1].q[0] < 1.2


def test_progress_is_told(flat: ContactGenerator) -> None:
    told: list[Progress] = []
    states = walk(flat, straight(0.5), budget=Budget(report=told.append))
    assert {progress.stage for progress in told} == {"sequence"}
    fractions = [progress.fraction for progress in told]
    assert fractions == sorted(fractions)
    assert fractions[0] == 0
    assert fractions[-1] < 1
    assert told[-1].states >= len(states) - 1


def test_the_caller_may_stop_a_walk(flat: ContactGenerator) -> None:
    asked = iter([False] * 3)
    with pytest.raises(Cancelled, match="sequence") as caught:
        walk(flat, straight(2.0), budget=Budget(cancelled=lambda: next(asked, True)))
    assert caught.value.fraction > 0
    assert caught.value.states[-1].q[0] == pytest.approx(2.0 * caught.value.fraction)


def test_a_walk_keeps_its_time_limit(flat: ContactGenerator) -> None:
    budget = Budget(0.05)
    with pytest.raises(TimeLimitReached, match="sequence"):
        walk(flat, straight(4.5), budget=budget)
    assert budget.elapsed < 2
