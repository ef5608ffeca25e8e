"""The one validation of requests: every field at fault is named, whatever made the request."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from rbprm_core.contacts.along_guide.options import SequenceOptions
from rbprm_core.errors import InvalidInput
from rbprm_core.guide.guide_options import GuideOptions, RrtOptions
from rbprm_core.guide.root_space import RootBounds
from rbprm_core.placement import Placement
from rbprm_core.plan_record import GRIP_FORCE
from rbprm_core.request import (
    PlannerOptions,
    PlanRequest,
    StageNames,
    check_options,
    read_options,
)
from rbprm_core.statics import GRIP_FORCE as STATICS_GRIP_FORCE
from rbprm_core.validation import naming_fields, renamed_field

LIMBS = ("lf", "rf", "lh", "rh")
NAN, INF = float("nan"), float("inf")


def box(**changes: Any) -> RootBounds:
    values = {"low": np.zeros(3), "high": np.ones(3), "half_ranges": np.array([0.4, 0.2, 0.2])}
    return RootBounds(**{**values, **changes})


def made(**changes: Any) -> PlanRequest:
    request = PlanRequest(
        start=Placement.parse([0.1, 0.2, 0.5]),
        goal=Placement.parse([0.9, 0.2, 0.5]),
        bounds=box(),
        required_limbs=LIMBS,
        start_limbs=LIMBS[:3],
        robustness_threshold=2.0,
    )
    return replace(request, **changes)


def test_a_good_request_keeps_its_values() -> None:
    request = made(goal_limbs=("rf",), gravity=[0, 0, -1.6], robustness_threshold=3, time_limit=9)
    checked = request.validated(LIMBS)
    assert checked.start is request.start
    assert checked.bounds is request.bounds
    assert checked.options is request.options
    assert checked.gravity.tolist() == [0.0, 0.0, -1.6]
    assert (checked.robustness_threshold, checked.time_limit) == (3.0, 9)
    assert checked.goal_limbs == ("rf",)


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"start": Placement(np.array([0, NAN, 0]), np.array([0, 0, 0, 1.0]))}, "start.position"),
        ({"goal": Placement(np.zeros(3), np.zeros(4))}, "goal.orientation"),
        ({"goal": Placement(np.full(3, 1e9), np.array([0, 0, 0, 1.0]))}, "goal.position"),
        ({"bounds": box(low=np.zeros(2))}, "bounds.low"),
        ({"bounds": box(low=np.array([0, 2.0, 0]))}, "bounds.y"),
        ({"bounds": box(low=np.array([0, NAN, 0]))}, "bounds.y.0"),
        ({"bounds": box(half_ranges=np.array([0.1, 0.1, NAN]))}, "bounds.roll"),
        ({"bounds": box(high=np.array([1, 1, 1e9]))}, "bounds.z.1"),
        ({"bounds": box(half_ranges=np.array([0.1, -0.1, 0.1]))}, "bounds.pitch"),
        ({"bounds": box(half_ranges=np.array([9.0, 0.1, 0.1]))}, "bounds.yaw"),
        ({"required_limbs": ("lf", "tail")}, "required_limbs.1"),
        ({"start_limbs": ("lf", "rf", "lf")}, "start_limbs.2"),
        ({"goal_limbs": ("tail",)}, "goal_limbs.0"),
        ({"robustness_threshold": -1.0}, "robustness_threshold"),
        ({"robustness_threshold": NAN}, "robustness_threshold"),
        ({"robustness_threshold": 1e30}, "robustness_threshold"),
        ({"seed": -1}, "seed"),
        ({"gravity": np.zeros(2)}, "gravity.2"),
        ({"gravity": np.array([0, 0, INF])}, "gravity.2"),
        ({"gravity": np.array([0, 0, -101.0])}, "gravity.2"),
        ({"grip_force": 0.0}, "grip_force"),
        ({"time_limit": 0.0}, "time_limit"),
        ({"stages": StageNames(guide="astar")}, "stages.guide"),
        ({"stages": StageNames(contacts="best")}, "stages.contacts"),
        ({"options": PlannerOptions(guides=0)}, "options.guides"),
        (
            {"options": PlannerOptions(guide=GuideOptions(rrt=RrtOptions(iterations=0)))},
            "options.guide.rrt.iterations",
        ),
        (
            {"options": PlannerOptions(sequence=SequenceOptions(step=0.01))},
            "options.sequence.min_step",
        ),
    ],
)
def test_the_field_at_fault_is_named(changes: dict[str, Any], field: str) -> None:
    with pytest.raises(InvalidInput) as caught:
        made(**changes).validated(LIMBS)
    assert caught.value.field == field


def test_contradictory_options_name_both() -> None:
    options = PlannerOptions(sequence=SequenceOptions(step=0.1, min_step=0.2))
    with pytest.raises(InvalidInput, match=r"contradicts sequence\.step = 0\.1") as caught:
        check_options(options)
    assert (caught.value.field, caught.value.value) == ("sequence.min_step", 0.2)
    with pytest.raises(InvalidInput, match=r"contradicts options\.sequence\.step = 0\.1"):
        read_options({"sequence": {"step": 0.1, "min_step": 0.2}})
    check_options(PlannerOptions(sequence=SequenceOptions(step=0.1, min_step=0.1)))


@pytest.mark.parametrize(
    ("data", "field"),
    [
        ({"gait": 2}, "options.gait"),
        ({"generator": {"spacing": 0.0}}, "options.generator.spacing"),
        ({"generator": 3}, "options.generator"),
    ],
)
def test_options_of_a_file(data: dict[str, Any], field: str) -> None:
    with pytest.raises(InvalidInput) as caught:
        read_options(data)
    assert caught.value.field == field


def test_there_and_back_as_a_file_holds_it() -> None:
    options = PlannerOptions(sequence=SequenceOptions(root_slack=0.02))
    request = made(goal_limbs=("rf",), seed=7, options=options, stages=StageNames(guide="prm"))
    entry = request.entry()
    assert entry.position_tolerance == pytest.approx(0.021)
    assert entry.options is not None
    again = PlanRequest.from_fields(
        entry,
        LIMBS,
        seed=entry.seed,
        options=read_options(entry.options),
        stages=StageNames(**entry.stages.model_dump()),
    )
    assert again.entry() == entry
    assert again.options == options


def test_limbs_that_a_file_leaves_out_are_all_limbs() -> None:
    entry = made().entry().model_copy(update={"required_limbs": None, "start_limbs": None})
    request = PlanRequest.from_fields(entry, LIMBS)
    assert request.required_limbs == request.start_limbs == LIMBS
    with pytest.raises(InvalidInput) as caught:
        PlanRequest.from_fields(entry.model_copy(update={"bounds": None}), LIMBS)
    assert caught.value.field == "bounds"


@pytest.mark.parametrize(
    ("field", "wanted"),
    [
        ("start.position.2", "start.pose.position.2"),
        ("start_limbs.0", "request.start_limbs.0"),
        ("bounds.x.0", "bounds.low.x"),
        ("bounds.x", "bounds.x"),
        ("seed", "request.seed"),
    ],
)
def test_fields_in_other_words(field: str, wanted: str) -> None:
    names = {"start": "start.pose", "bounds": "bounds", "bounds.x.0": "bounds.low.x"}
    assert renamed_field(field, names, "request.") == wanted
    with pytest.raises(InvalidInput) as caught, naming_fields(names, "request."):
        raise InvalidInput(field, 3, "is wrong")
    assert (caught.value.field, caught.value.value) == (wanted, 3)
    assert str(caught.value) == f"{wanted} = 3: is wrong"


def test_plan_records_and_statics_have_the_same_default_grip_force() -> None:
    """Records import nothing that plans, so the number stands in both places."""
    assert GRIP_FORCE == STATICS_GRIP_FORCE
