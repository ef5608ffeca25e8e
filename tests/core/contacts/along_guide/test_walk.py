"""One step of a walk: which contact is moved, and contact of a limb without a free posture."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
import pytest
from numpy.typing import NDArray

from rbprm_core.body.state import State
from rbprm_core.contacts.along_guide import ContactGenerator, SequenceOptions, start_state
from rbprm_core.contacts.along_guide.walk import Walk
from rbprm_core.contacts.along_guide.walk_state import WalkState
from rbprm_core.failures import Cause, Failure
from rbprm_core.guide.root import GuidePath
from rbprm_core.robot.data import RobotData
from rbprm_core.scene import Scene, Surface, make_surface

Array = NDArray[np.float64]
Box = Callable[..., list[Surface]]
GRAVITY = np.array([0.0, 0.0, -9.81])
LEGS = (0, 1, 2, 3)
PAPERS = SequenceOptions(prefer_supported=False)
PLAIN = SequenceOptions()
STUCK = Failure.of(Cause.ROOT_COLLISION)
PIT = (
    [[-2, 0.25, 0], [4, 0.25, 0], [4, 2, 0], [-2, 2, 0]],  # for the left legs
    [[0.2, -2, 0], [4, -2, 0], [4, 0, 0], [0.2, 0, 0]],  # for the right ones, before x = 0.2 none
)

GUIDE = GuidePath(np.array([[0, 0, 0.6, 0, 0, 0, 1], [2, 0, 0.6, 0, 0, 0, 1.0]]))


def walk(
    generator: ContactGenerator, options: SequenceOptions = PLAIN, guide: GuidePath = GUIDE
) -> Walk:
    return Walk(generator, guide, np.random.default_rng(0), options)


def standing(generator: ContactGenerator, limbs: tuple[int, ...] = LEGS) -> WalkState:
    return start_state(generator, GUIDE.nodes[0], limbs)


def limbs_of(state: State) -> list[int]:
    return [contact.limb for contact in state.contacts]


def reach(generator: ContactGenerator, limb: int) -> Failure:
    """The failure of a step in which a limb cannot keep its contact."""
    return Failure.of(Cause.SECOND_CONTACT_OUT_OF_REACH, generator.robot.limbs[limb].name)


def without_posture(
    generator: ContactGenerator, limbs: Iterable[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Let limbs find no posture in which they touch nothing."""
    rest, barred = generator.rest, set(limbs)

    def barred_rest(
        q: Array, limb: int, rng: np.random.Generator, ignored: Iterable[int] = ()
    ) -> Array | None:
        return None if limb in barred else rest(q, limb, rng, ignored)

    monkeypatch.setattr(generator, "rest", barred_rest)


@pytest.fixture
def flat(hyq_data: RobotData, flat_scene: Scene) -> ContactGenerator:
    return ContactGenerator(hyq_data, flat_scene, GRAVITY, 5.0)


@pytest.fixture
def pit(hyq_data: RobotData) -> ContactGenerator:
    """No ground for the right hind leg; equilibrium is not required."""
    surfaces = [make_surface(f"g{k}", ring, 0.5) for k, ring in enumerate(PIT)]
    return ContactGenerator(hyq_data, Scene(surfaces), GRAVITY, -np.inf)


@pytest.mark.parametrize("blamed", LEGS)
def test_the_blamed_limb_is_moved_first(flat: ContactGenerator, blamed: int) -> None:
    state = standing(flat)
    found = walk(flat, PAPERS).reposition(state, 0.0, set(), reach(flat, blamed))
    assert found is not None
    assert limbs_of(found)[-1] == blamed  # the moved contact is the newest
    assert limbs_of(found)[:-1] == [limb for limb in limbs_of(state) if limb != blamed]
    old, new = state.contact_of(blamed), found.contact_of(blamed)
    assert old is not None
    assert new is not None
    assert np.linalg.norm(old.position - new.position) > 0.015
    assert np.array_equal(found.q[:7], state.q[:7])
    assert found.robustness >= 5.0


def test_where_no_limb_is_at_fault_the_oldest_contact_is_moved(flat: ContactGenerator) -> None:
    state = standing(flat)
    stepping = walk(flat, PAPERS)
    moved: list[int] = []
    for _ in range(3):
        found = stepping.reposition(state, 0.0, set(moved), STUCK)
        assert found is not None
        oldest = next(limb for limb in limbs_of(state) if limb not in moved)
        assert limbs_of(found)[-1] == oldest
        moved.append(oldest)
        state = found
    assert stepping.reposition(state, 0.0, {*LEGS}, STUCK) is None  # each once at a root


def test_only_what_bears_nothing_is_moved_unless_the_walk_is_stuck(
    flat: ContactGenerator,
) -> None:
    state = standing(flat)
    stepping = walk(flat, PLAIN)
    idle = {
        contact.limb
        for contact in state.contacts
        if flat.body.robustness(state.q, [c for c in state.contacts if c is not contact]) >= 0
    }
    assert 0 < len(idle) < 4
    found = stepping.reposition(state, 0.0, set(), None)
    assert found is not None
    assert limbs_of(found)[-1] in idle
    assert stepping.reposition(state, 0.0, idle, None) is None
    stuck = stepping.reposition(state, 0.0, idle, STUCK)
    assert stuck is not None
    assert limbs_of(stuck)[-1] not in idle
    papers = walk(flat, PAPERS)
    assert papers.reposition(state, 0.0, set(), None) is None


def test_a_free_limb_is_put_down_before_another_is_moved(flat: ContactGenerator) -> None:
    state = standing(flat, (0, 1, 2))
    found = walk(flat).reposition(state, 0.0, set(), reach(flat, 1))
    assert found is not None
    assert limbs_of(found) == [*limbs_of(state), 3]
    assert found.free == ()


def test_a_contact_made_at_rest(flat: ContactGenerator, pit: ContactGenerator) -> None:
    state = standing(flat, (0, 1, 2))
    made = walk(flat).make(state, 0.0, 3)
    assert made is not None
    assert limbs_of(made) == [0, 1, 2, 3]
    assert made.free == ()
    assert made.robustness == pytest.approx(flat.body.robustness(made.q, made.contacts))
    assert walk(pit).make(standing(pit, (0, 1, 2)), 0.0, 3) is None


def test_a_limb_that_rests_need_not_make_contact(pit: ContactGenerator) -> None:
    found = walk(pit).advance(standing(pit, (0, 1, 2)), 0.02)
    assert isinstance(found, WalkState)
    assert (limbs_of(found), found.free) == ([0, 1, 2], (3,))


def test_a_limb_without_a_posture_has_to_make_contact(
    flat: ContactGenerator, monkeypatch: pytest.MonkeyPatch
) -> None:
    state = standing(flat, (0, 1, 2))
    without_posture(flat, [3], monkeypatch)
    found = walk(flat).advance(state, 0.02)
    assert isinstance(found, WalkState)
    assert limbs_of(found) == [0, 1, 2, 3]


def test_a_limb_with_neither_posture_nor_contact_is_in_the_way(
    pit: ContactGenerator, monkeypatch: pytest.MonkeyPatch
) -> None:
    state = standing(pit, (0, 1, 2))
    without_posture(pit, [3], monkeypatch)
    found = walk(pit).advance(state, 0.02)
    assert found == Failure.of(Cause.NO_CANDIDATE, pit.robot.limbs[3].name)


def test_one_limb_at_most_is_without_a_posture(
    pit: ContactGenerator, monkeypatch: pytest.MonkeyPatch
) -> None:
    state = standing(pit, (0, 1))
    assert state.free == (2, 3)
    without_posture(pit, [2, 3], monkeypatch)
    found = walk(pit).advance(state, 0.02)
    assert found == Failure.of(Cause.NO_FREE_POSTURE, pit.robot.limbs[3].name)


def test_the_limb_that_broke_is_the_one_that_makes_contact(
    hyq_data: RobotData, flat_scene: Scene
) -> None:
    """Another that is free has to wait: a transition has one change."""
    flat = ContactGenerator(hyq_data, flat_scene, GRAVITY, -np.inf)
    state = standing(flat, (0, 1, 2))
    aside = GuidePath(np.array([[0, 0, 0.6, 0, 0, 0, 1], [1, 0.9, 0.6, 0, 0, 0, 1.0]]))
    seen = 0
    for mark in np.arange(0.02, 0.8, 0.02):
        found = walk(flat, PAPERS, aside).advance(state, float(mark))
        if isinstance(found, Failure):
            continue
        kept = [limb for limb in (0, 1, 2) if found.contact_of(limb) is state.contact_of(limb)]
        made = [limb for limb in limbs_of(found) if limb not in kept]
        assert len(kept) >= 2
        assert len(made) <= 1
        if len(kept) == 2:
            seen += 1
            broken = ({0, 1, 2} - {*kept}).pop()
            assert made in ([], [broken])
            assert found.free[0] == 3
    walked = walk(flat).advance(state, 1.5)
    assert isinstance(walked, Failure)
    assert walked.cause == Cause.SECOND_CONTACT_OUT_OF_REACH
    assert walked.limb in [flat.robot.limbs[k].name for k in (0, 1, 2)]
    assert seen > 0


def test_a_root_in_an_obstacle_is_an_obstruction(
    hyq_data: RobotData, flat_scene: Scene, make_box: Box
) -> None:
    wall = make_box("wall", np.array([1.2, -3, 0.2]), np.array([1.4, 3, 2.0]))
    generator = ContactGenerator(hyq_data, flat_scene.edited(changed=wall), GRAVITY, 5.0)
    found = walk(generator).advance(standing(generator), 1.0)
    assert found == Failure.of(Cause.ROOT_COLLISION)


def test_a_state_under_the_threshold_is_taken_down_to_the_fallback_only(
    hyq_data: RobotData, flat_scene: Scene
) -> None:
    able = ContactGenerator(hyq_data, flat_scene, GRAVITY, 5.0)
    state = standing(able)
    strict = ContactGenerator(hyq_data, flat_scene, GRAVITY, 1e4)
    refused = walk(strict).advance(state, 0.02)
    assert isinstance(refused, Failure)
    assert refused.cause == Cause.LOW_ROBUSTNESS
    assert refused.figure("threshold") == 1e4
    assert refused.figure("robustness") < 1e4
    taken = walk(strict).advance(state, 0.02, fallback=0.0)
    assert isinstance(taken, WalkState)
    assert 0 <= taken.robustness < 1e4
    assert isinstance(walk(strict).advance(state, 0.02, fallback=9e3), Failure)


def test_what_is_supported(flat: ContactGenerator) -> None:
    state = standing(flat)
    stepping = walk(flat)
    assert stepping.supported(state, state)
    for contact in state.contacts:
        others = [c for c in state.contacts if c is not contact]
        lifted = flat.state(state.q, others, [contact.limb], 0.0)
        bears = flat.body.robustness(state.q, others) >= 0
        assert stepping.supported(state, lifted) == bears
        assert stepping.supported(lifted, state) == bears
        assert walk(flat, PAPERS).supported(state, lifted)
