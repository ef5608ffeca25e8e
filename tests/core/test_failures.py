"""Failures as data: causes, fields and figures."""

from __future__ import annotations

import pickle

import pytest

from rbprm_core.counters import no_contact
from rbprm_core.failures import CONTACT_CAUSES, Cause, Failure

VALUES = {
    "UNSPECIFIED": 0,
    "TRUNK_IN_OBSTACLE": 1,
    "TRUNK_COLLISION": 2,
    "NO_SURFACE_OF_KIND": 3,
    "NO_SURFACE_IN_WORKSPACE": 4,
    "WEIGHT_UNSUPPORTED": 5,
    "ROOT_COLLISION": 20,
    "LIMB_COLLISION": 21,
    "REFERENCE_POSTURE_COLLISION": 22,
    "LOW_ROBUSTNESS": 23,
    "SURFACE_LOST": 24,
    "BODY_COLLISION": 25,
    "NO_START_LIMBS": 26,
    "CONTACT_NOT_REACHED": 27,
    "SELF_COLLISION": 28,
    "TORQUE_LIMIT": 29,
    "TASK_NOT_MET": 30,
    "NO_CANDIDATE": 40,
    "NO_KINEMATIC_SOLUTION": 41,
    "NO_EQUILIBRIUM": 42,
    "SECOND_CONTACT_OUT_OF_REACH": 60,
    "SECOND_CONTACT_COLLISION": 61,
    "NO_FREE_POSTURE": 62,
    "TREES_NOT_CONNECTED": 80,
    "ROADMAP_NOT_CONNECTED": 81,
    "NO_VALID_PATH": 82,
    "EXECUTED_STATE_INVALID": 100,
    "PROCESS_DIED": 120,
}


def test_the_values_of_the_causes_stay() -> None:
    """Messages use the values: a cause may be added, none may change."""
    assert {cause.name: cause.value for cause in Cause} == VALUES


def test_a_failure_has_its_fields_and_figures() -> None:
    failure = Failure.of(Cause.SURFACE_LOST, "lf", surface="ground", x=1.0, y=2.0, z=3.0)
    assert failure == Failure(
        Cause.SURFACE_LOST, "lf", "ground", figures=(("x", 1.0), ("y", 2.0), ("z", 3.0))
    )
    assert (failure.limb, failure.surface, failure.body, failure.kinds) == ("lf", "ground", "", ())
    assert [failure.figure(name) for name in "xyz"] == [1.0, 2.0, 3.0]
    with pytest.raises(KeyError):
        failure.figure("scale")


def test_failures_with_equal_data_are_equal() -> None:
    one, same = (Failure.of(Cause.NO_CANDIDATE, "lf") for _ in range(2))
    assert one == same
    assert len({one, same, Failure.of(Cause.NO_CANDIDATE, "rf")}) == 2
    kinds = Failure.of(Cause.NO_SURFACE_OF_KIND, "lf", kinds=("support",))
    assert pickle.loads(pickle.dumps(kinds)) == kinds


def test_counters_are_named_after_the_causes() -> None:
    assert [no_contact(cause) for cause in CONTACT_CAUSES] == [
        "no_contact.no_candidate",
        "no_contact.no_kinematic_solution",
        "no_contact.no_equilibrium",
    ]
