"""The check on a hand-made plan of HyQ: a clean pass, and one mutation for each bound."""

from __future__ import annotations

import copy
import json
import time
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from scipy.optimize import least_squares

from rbprm_core.arrays import Array
from rbprm_core.check import CheckReport, Kind, Violation, check_plan, figures
from rbprm_core.check.robot_model import Robot
from rbprm_core.check.static_equilibrium import state_robustness
from rbprm_core.errors import InvalidInput
from rbprm_core.plan_record import ContactEntry, ContactPlan, RobotEntry
from rbprm_core.resources import find_resource

URDF = "example-robot-data/robots/hyq_description/robots/hyq_no_sensors.urdf"
SRDF = "example-robot-data/robots/hyq_description/srdf/hyq.srdf"
TALOS = "example-robot-data/robots/talos_data/robots/talos_reduced.urdf"
GROUND = "hpp_environments/meshes/multicontact/ground.stl"
LEGS = ("lf", "rf", "lh", "rh")
RADIUS = 0.02175  # metres, of the balls that are the feet's collision geometry
HEIGHT = 0.67  # metres, of the root above the ground
GRAVITY = np.array([0.0, 0.0, -9.81])
THRESHOLD = 5.0

Point = Array
Document = dict[str, Any]
Found = set[tuple[int, str, str]]


def up(length: float) -> Point:
    return np.array([0.0, 0.0, length])


def ahead(length: float) -> Point:
    return np.array([length, 0.0, 0.0])


def shifted(points: Any, length: float) -> Any:
    return (np.array(points) + ahead(length)).tolist()


class Hyq:
    """Makes states of HyQ with its feet at given points, and with all that a state declares."""

    def __init__(self) -> None:
        self.model = pin.buildModelFromUrdf(
            str(find_resource(URDF, "urdf")), pin.JointModelFreeFlyer()
        )
        self.data = self.model.createData()
        pin.loadReferenceConfigurations(self.model, str(find_resource(SRDF, "srdf")))
        self.standing = self.model.referenceConfigurations["standing"]
        q = self.standing.copy()
        q[2] = HEIGHT
        pin.framesForwardKinematics(self.model, self.data, q)
        self.feet = {leg: self.foot(leg).translation * (1, 1, 0) for leg in LEGS}

    def foot(self, leg: str) -> pin.SE3:
        return self.data.oMf[self.model.getFrameId(f"{leg}_foot", pin.BODY)]

    def reach(self, root: Point, centres: Mapping[str, Point]) -> Array:
        """Configuration (nq,) with the centres of the balls at given points."""
        q = self.standing.copy()
        q[:3] = root
        for leg, centre in centres.items():
            k = self.model.joints[self.model.getJointId(f"{leg}_haa_joint")].idx_q

            def miss(angles: Point, k: int = k, leg: str = leg, centre: Point = centre) -> Point:
                q[k : k + 3] = angles
                pin.framesForwardKinematics(self.model, self.data, q)
                return np.asarray(self.foot(leg).translation - centre)

            solution = least_squares(miss, self.standing[k : k + 3], xtol=1e-14, ftol=1e-14)
            assert np.linalg.norm(solution.fun) < 1e-6
            q[k : k + 3] = solution.x
        return q

    def contact(self, leg: str, point: Point, sink: float, friction: float) -> Document:
        """A contact of a foot with the floor; the ball reaches `sink` metres below the point."""
        foot = self.foot(leg)
        offset = foot.rotation.T @ [0, 0, -(RADIUS - sink)]
        turned = pin.Quaternion(foot.rotation.T.copy()).coeffs()
        return {
            "limb": f"{leg}_leg",
            "frame": f"{leg}_foot",
            "frame_offset": {"position": offset.tolist(), "orientation": turned.tolist()},
            "type": "point",
            "position": point.tolist(),
            "orientation": [0, 0, 0, 1],
            "normal": [0, 0, 1],
            "points": [point.tolist()],
            "friction": friction,
            "surface": "floor",
        }

    def state(
        self,
        shift: tuple[float, float],
        feet: Mapping[str, Point],
        air: Mapping[str, Point] | None = None,
        sink: Mapping[str, float] | None = None,
    ) -> Document:
        """A state with the root shifted, stance feet at `feet`, centres of swing feet at `air`."""
        sunk = {leg: (sink or {}).get(leg, 0.0) for leg in LEGS}
        centres = {leg: point + up(RADIUS - sunk[leg]) for leg, point in feet.items()}
        q = self.reach(np.array([*shift, HEIGHT]), {**centres, **(air or {})})
        pin.framesForwardKinematics(self.model, self.data, q)
        contacts = [self.contact(leg, feet[leg], sunk[leg], 0.5) for leg in feet]
        state = {
            "root": {"position": q[:3].tolist(), "orientation": q[3:7].tolist()},
            "joints": q[7:].tolist(),
            "contacts": contacts,
        }
        return self.refresh(state)

    def refresh(self, state: Document) -> Document:
        """Set the declared centre of mass and robustness of a state to their true values."""
        root = state["root"]
        q = np.array([*root["position"], *root["orientation"], *state["joints"]])
        com = pin.centerOfMass(self.model, self.data, q)
        contacts = [ContactEntry.model_validate(contact) for contact in state["contacts"]]
        load = pin.computeTotalMass(self.model) * GRAVITY
        b0, _ = state_robustness(contacts, com, load)
        state["com"], state["robustness"] = com.tolist(), b0
        return state


def document(states: list[Document], hyq: Hyq) -> Document:
    roots = [state["root"] for state in states]
    return {
        "format": "rbprm-contact-plan/1",
        "robot": {
            "name": "hyq",
            "urdf": URDF,
            "srdf": SRDF,
            "joint_names": list(hyq.model.names)[2:],
        },
        "environment": {"name": "ground", "meshes": [{"file": GROUND}]},
        "request": {
            "start": roots[0],
            "goal": roots[-1],
            "robustness_threshold": THRESHOLD,
        },
        "guide": [roots[0], roots[-1]],
        "states": states,
    }


def walk(
    hyq: Hyq, made: Point | None = None, sink: float = 0.0, lift: float = 0.05
) -> list[Document]:
    """Four states: stance, left front foot lifted, foot put 5 cm ahead, trunk moved."""
    feet = hyq.feet
    three = {leg: feet[leg] for leg in LEGS if leg != "lf"}
    four = {**feet, "lf": feet["lf"] + ahead(0.05) if made is None else made}
    air = {"lf": feet["lf"] + up(RADIUS + lift)}
    sunk = {"lf": sink}
    return [
        hyq.state((0, 0), feet),
        hyq.state((-0.08, -0.06), three, air=air),
        hyq.state((-0.08, -0.06), four, sink=sunk),
        hyq.state((0.02, 0.0), four, sink=sunk),
    ]


@pytest.fixture(scope="module")
def hyq() -> Hyq:
    return Hyq()


@pytest.fixture(scope="module")
def clean(hyq: Hyq) -> Document:
    return document(walk(hyq), hyq)


def checked(plan: Document) -> CheckReport:
    return check_plan(ContactPlan.model_validate(plan))


def found(report: CheckReport) -> Found:
    return {(v.state, v.limb, v.kind) for v in report.violations}


def contact_of(plan: Document, state: int, leg: str) -> Document:
    contacts: list[Document] = plan["states"][state]["contacts"]
    return next(c for c in contacts if c["limb"] == f"{leg}_leg")


def test_clean_plan_passes(clean: Document) -> None:
    report = checked(clean)
    assert report.violations == ()
    assert report.valid
    assert report.states == 4
    assert report.transitions == 2
    assert report.min_robustness == pytest.approx(min(report.robustness))
    assert report.min_robustness > THRESHOLD
    assert report.deepest_collision < 1e-4


def test_violation_reads_as_one_line() -> None:
    text = "contact point 4.1 mm from the environment (at most 3.0 mm)"
    line = f"state 12, limb lf_leg: {text}"
    assert str(Violation(12, "lf_leg", Kind.OFF_ENVIRONMENT, text)) == line
    assert str(Violation(3, "", Kind.COM, "off")) == "state 3: off"
    assert str(Violation(-1, "", Kind.NO_STATE, "none")) == "plan: none"


Mutation = Callable[[Document, Hyq], None]


def no_states(plan: Document, hyq: Hyq) -> None:
    plan["states"] = []


def joint_order(plan: Document, hyq: Hyq) -> None:
    plan["robot"]["joint_names"] = plan["robot"]["joint_names"][::-1]
    for state in plan["states"]:
        state["joints"] = state["joints"][::-1]


def scaled(values: list[float], factor: float) -> list[float]:
    return [factor * value for value in values]


def root_quaternion(plan: Document, hyq: Hyq) -> None:
    root = plan["states"][1]["root"]
    plan["states"][1]["root"] = {**root, "orientation": scaled(root["orientation"], 1.01)}


def guide_quaternion(plan: Document, hyq: Hyq) -> None:
    plan["guide"] = [{"position": [0, 0, 0], "orientation": [0, 0, 0, 0.9]}]


def contact_quaternion(plan: Document, hyq: Hyq) -> None:
    contact_of(plan, 2, "rh")["orientation"] = [0, 0, 0, 1.01]


def offset_quaternion(plan: Document, hyq: Hyq) -> None:
    offset = contact_of(plan, 2, "rh")["frame_offset"]
    offset["orientation"] = scaled(offset["orientation"], 0.99)


def long_normal(plan: Document, hyq: Hyq) -> None:
    contact_of(plan, 0, "lh")["normal"] = [0, 0, 1.01]


def joint_limit(plan: Document, hyq: Hyq) -> None:
    state = plan["states"][1]
    state["joints"][1:3] = [1.0, -0.34]
    hyq.refresh(state)


def limb_twice(plan: Document, hyq: Hyq) -> None:
    state = plan["states"][3]
    state["contacts"].append(copy.deepcopy(contact_of(plan, 3, "rf")))
    hyq.refresh(state)


def shifted_contact(plan: Document, hyq: Hyq) -> None:
    contact = contact_of(plan, 3, "rf")
    contact["position"] = shifted(contact["position"], 0.0016)
    contact["points"] = [contact["position"]]
    hyq.refresh(plan["states"][3])


def point_elsewhere(plan: Document, hyq: Hyq) -> None:
    contact = contact_of(plan, 2, "rf")
    contact["points"] = shifted(contact["points"], 0.0005)


def two_points(plan: Document, hyq: Hyq) -> None:
    state = plan["states"][0]  # the swing leg of the next state, so that nothing else changes
    contact_of(plan, 0, "lf")["points"] *= 2
    hyq.refresh(state)


def floating_contact(plan: Document, hyq: Hyq) -> None:
    plan["states"] = walk(hyq, made=hyq.feet["lf"] + ahead(0.05) + up(0.0032))


def tilted_normal(plan: Document, hyq: Hyq) -> None:
    tilt = np.deg2rad(3.2)
    for k in (2, 3):
        contact_of(plan, k, "lf")["normal"] = [np.sin(tilt), 0, np.cos(tilt)]
        hyq.refresh(plan["states"][k])


def foot_too_deep(plan: Document, hyq: Hyq) -> None:
    plan["states"] = walk(hyq, sink=0.0102)


def free_foot_too_deep(plan: Document, hyq: Hyq) -> None:
    plan["states"] = walk(hyq, lift=-0.0022)


def leg_through_leg(plan: Document, hyq: Hyq) -> None:
    state = plan["states"][1]
    state["joints"][:3] = [0.197, -0.273, -2.44]
    hyq.refresh(state)


def shifted_com(plan: Document, hyq: Hyq) -> None:
    com = plan["states"][2]["com"]
    plan["states"][2]["com"] = [com[0], com[1] + 0.0012, com[2]]


def out_of_balance(plan: Document, hyq: Hyq) -> None:
    plan["request"]["robustness_threshold"] = plan["states"][1]["robustness"] + 0.01


def boasting(plan: Document, hyq: Hyq) -> None:
    plan["states"][2]["robustness"] += 1.0


def two_changes(plan: Document, hyq: Hyq) -> None:
    for leg in ("rf", "rh"):
        contact_of(plan, 3, leg)["surface"] = "other"


def more_friction(plan: Document, hyq: Hyq) -> None:
    contact_of(plan, 3, "rh")["friction"] = 0.6
    hyq.refresh(plan["states"][3])


def start_away(plan: Document, hyq: Hyq) -> None:
    plan["request"]["start"] = {"position": [0.0012, 0, HEIGHT], "orientation": [0, 0, 0, 1]}


def goal_turned(plan: Document, hyq: Hyq) -> None:
    orientation = [0, 0, np.sin(0.0006), np.cos(0.0006)]
    plan["request"]["goal"] = {**plan["request"]["goal"], "orientation": orientation}


LF, RF, LH, RH = (f"{leg}_leg" for leg in LEGS)
MUTATIONS: list[tuple[Mutation, Found]] = [
    (no_states, {(-1, "", Kind.NO_STATE)}),
    (joint_order, {(-1, "", Kind.JOINT_ORDER)}),
    (root_quaternion, {(1, "", Kind.QUATERNION)}),
    (guide_quaternion, {(-1, "", Kind.QUATERNION)}),
    (contact_quaternion, {(2, RH, Kind.QUATERNION)}),
    (offset_quaternion, {(2, RH, Kind.QUATERNION)}),
    (long_normal, {(0, LH, Kind.UNIT_NORMAL)}),
    (joint_limit, {(1, "", Kind.JOINT_LIMIT)}),
    (limb_twice, {(3, RF, Kind.LIMB_TWICE)}),
    (shifted_contact, {(3, RF, Kind.CONTACT_POSE)}),
    (point_elsewhere, {(2, RF, Kind.CONTACT_POINTS)}),
    (two_points, {(0, LF, Kind.CONTACT_POINTS)}),
    (floating_contact, {(2, LF, Kind.OFF_ENVIRONMENT), (3, LF, Kind.OFF_ENVIRONMENT)}),
    (tilted_normal, {(2, LF, Kind.NORMAL), (3, LF, Kind.NORMAL)}),
    (foot_too_deep, {(2, LF, Kind.COLLISION), (3, LF, Kind.COLLISION)}),
    (free_foot_too_deep, {(1, "", Kind.COLLISION)}),
    (leg_through_leg, {(1, "", Kind.SELF_COLLISION)}),
    (shifted_com, {(2, "", Kind.COM)}),
    (out_of_balance, {(1, "", Kind.STATICS)}),
    (boasting, {(2, "", Kind.ROBUSTNESS)}),
    (two_changes, {(3, "", Kind.CHANGES)}),
    (more_friction, {(3, RH, Kind.KEPT_FRICTION)}),
    (start_away, {(0, "", Kind.START)}),
    (goal_turned, {(3, "", Kind.GOAL)}),
]


@pytest.mark.parametrize(("mutate", "expected"), MUTATIONS, ids=lambda value: _name(value))
def test_one_broken_bound_gives_one_violation(
    clean: Document, hyq: Hyq, mutate: Mutation, expected: Found
) -> None:
    plan = copy.deepcopy(clean)
    mutate(plan, hyq)
    report = checked(plan)
    assert found(report) == expected, "\n".join(map(str, report.violations))
    assert len(report.violations) == len(expected)
    assert not report.valid


def _name(value: object) -> str:
    return getattr(value, "__name__", "")


def just_inside() -> list[Callable[[Document, Hyq], None]]:
    def foot_deep(plan: Document, hyq: Hyq) -> None:
        plan["states"] = walk(hyq, sink=0.0098)

    def free_foot_touching(plan: Document, hyq: Hyq) -> None:
        plan["states"] = walk(hyq, lift=-0.0018)

    def foot_above(plan: Document, hyq: Hyq) -> None:
        plan["states"] = walk(hyq, made=hyq.feet["lf"] + ahead(0.05) + up(0.0028))

    def normal_off(plan: Document, hyq: Hyq) -> None:
        tilt = np.deg2rad(2.8)
        for k in (2, 3):
            contact_of(plan, k, "lf")["normal"] = [np.sin(tilt), 0, np.cos(tilt)]
            hyq.refresh(plan["states"][k])

    def pose_off(plan: Document, hyq: Hyq) -> None:
        contact = contact_of(plan, 3, "rf")
        contact["position"] = shifted(contact["position"], 0.0014)
        contact["points"] = [contact["position"]]
        hyq.refresh(plan["states"][3])

    def start_near(plan: Document, hyq: Hyq) -> None:
        plan["request"]["start"] = {"position": [0.0009, 0, HEIGHT], "orientation": [0, 0, 0, 1]}

    return [foot_deep, free_foot_touching, foot_above, normal_off, pose_off, start_near]


@pytest.mark.parametrize("mutate", just_inside(), ids=_name)
def test_just_inside_a_bound_passes(clean: Document, hyq: Hyq, mutate: Mutation) -> None:
    plan = copy.deepcopy(clean)
    mutate(plan, hyq)
    report = checked(plan)
    assert report.valid, "\n".join(map(str, report.violations))


def test_figures_of_the_clean_plan(clean: Document) -> None:
    report = checked(clean)
    assert (report.overhanging, report.unsupported) == (0, 0.0)
    assert (report.goal_limbs, report.goal_missing) == (None, ())
    # The root shifts away from the foot before it is lifted, and stays there until it is put down.
    # So the other three hold the robot at one end of each transition at least.
    support = report.support
    assert support.both + support.one + support.neither == report.transitions == 2
    assert support.neither == 0


def test_contacts_asked_for_at_the_goal(clean: Document, hyq: Hyq) -> None:
    plan = copy.deepcopy(clean)
    plan["request"]["goal_limbs"] = [LF, RH]
    report = checked(plan)
    assert report.valid
    assert (report.goal_limbs, report.goal_missing) == ((LF, RH), ())
    plan["states"] = plan["states"][:2]  # the left front foot is in the air
    plan["request"]["goal"] = plan["states"][-1]["root"]
    report = checked(plan)
    assert report.valid, "a limb missing at the goal is a figure and not a violation"
    assert report.goal_missing == (LF,)
    assert figures(report)["contacts at the goal"] == f"missing {LF}"


def test_a_contact_has_no_more_friction_than_the_environment(clean: Document, hyq: Hyq) -> None:
    plan = copy.deepcopy(clean)
    for declared, valid in ((0.5, True), (0.7, True), (0.4, False)):
        plan["environment"]["meshes"][0]["friction"] = declared
        report = checked(plan)
        assert report.valid == valid
        assert {kind for _, _, kind in found(report)} == (set() if valid else {Kind.FRICTION})
    assert "contact friction 0.5 above the 0.4 of the environment" in str(report.violations[0])
    assert len(report.violations) == sum(len(state["contacts"]) for state in plan["states"])


def test_of_surfaces_that_meet_the_rougher_counts(hyq: Hyq) -> None:
    plan = document([hyq.state((0, 0), hyq.feet)], hyq)
    for x in (0.0, 5e-3):  # the border under a foot, and beyond the bound
        edge = float(hyq.feet["lf"][0]) - x
        ice = [[-2, -2, 0], [edge, -2, 0], [edge, 2, 0], [-2, 2, 0]]
        rock = [[edge, -2, 0], [2, -2, 0], [2, 2, 0], [edge, 2, 0]]
        plan["environment"] = {
            "surfaces": [
                {"id": "ice", "vertices": ice, "friction": 0.6},
                {"id": "rock", "vertices": rock, "friction": 0.5},
            ]
        }
        assert checked(plan).valid
        plan["environment"]["surfaces"][1]["friction"] = 0.3
        slipping = {limb for _, limb, _ in found(checked(plan))}
        assert (LF in slipping) == (x > 0)


def test_the_report_as_json(clean: Document, hyq: Hyq) -> None:
    plan = copy.deepcopy(clean)
    plan["request"]["goal_limbs"] = [LF]
    plan["states"][3]["contacts"] = []  # b0 is minus infinity, which JSON cannot hold
    report = checked(plan)
    text = json.loads(json.dumps(report.document(), allow_nan=False))
    assert text["valid"] is False
    assert len(text["violations"]) == len(report.violations)
    assert text["robustness"][3] is None
    assert text["robustness"][0] == pytest.approx(report.robustness[0])
    assert text["goal_contacts"] == {"asked": [LF], "missing": [LF], "reached": False}
    assert text["overhanging"] == {"contacts": 0, "greatest_share": 0.0}
    ends = text["transitions"]["stable_without_moving_contact"]
    assert sum(ends.values()) == text["transitions"]["count"] == report.transitions
    assert checked(clean).document()["goal_contacts"]["reached"] is None


def test_slow_drift_is_held_against_where_the_contact_was_made(hyq: Hyq) -> None:
    step = ahead(0.0006)
    feet = [{**hyq.feet, "lf": hyq.feet["lf"] + k * step} for k in range(5)]
    report = checked(document([hyq.state((0, 0), f) for f in feet], hyq))
    assert found(report) == {(3, LF, Kind.DRIFT)}
    assert report.transitions == 0


def test_neighbours_may_move_one_limb(hyq: Hyq) -> None:
    moved = {**hyq.feet, "lf": hyq.feet["lf"] + ahead(0.05)}
    both = {**moved, "rf": hyq.feet["rf"] + ahead(0.05)}
    start, one = hyq.state((0, 0), hyq.feet), hyq.state((0, 0), moved)
    two = hyq.state((0, 0), both)
    assert checked(document([start, one, two], hyq)).valid
    assert found(checked(document([start, two], hyq))) == {(1, "", Kind.CHANGES)}


def flat_floor() -> Document:
    """A non-convex floor with a hole ahead of where the left front foot is put."""
    outline = [[-2, -2, 0], [2, -2, 0], [2, 2, 0], [1.5, 2, 0], [1.5, 1, 0], [-2, 1, 0]]
    hole = [[0.44, 0.1, 0], [0.44, 0.6, 0], [0.6, 0.6, 0], [0.6, 0.1, 0]]
    return {"id": "floor", "vertices": outline, "holes": [hole]}


def planar(hyq: Hyq, at: Point, yaw: float = 0.0, half: float = 0.012) -> Document:
    """A stance with a square patch declared under the left front foot."""
    state = hyq.state((0, 0), {**hyq.feet, "lf": at})
    contact = next(c for c in state["contacts"] if c["limb"] == LF)
    corners = [[half, half, 0], [-half, half, 0], [-half, -half, 0], [half, -half, 0]]
    turn = pin.rpy.rpyToMatrix(0, 0, yaw)
    contact["type"] = "planar"
    contact["orientation"] = pin.Quaternion(turn).coeffs().tolist()
    contact["points"] = (np.array(corners) @ turn.T + at).tolist()
    return hyq.refresh(state)


def on_surfaces(hyq: Hyq, state: Document) -> Document:
    plan = document([state], hyq)
    plan["environment"] = {"surfaces": [flat_floor()]}
    return plan


def test_patch_on_polygons_passes_until_a_corner_overhangs(hyq: Hyq) -> None:
    foot = hyq.feet["lf"]
    edge = np.array([0.44, foot[1], 0.0])
    near, over = edge - ahead(0.0105), edge - ahead(0.0085)  # corners 1.5 and 3.5 mm past it
    assert checked(on_surfaces(hyq, planar(hyq, near))).valid
    report = checked(on_surfaces(hyq, planar(hyq, over)))
    assert found(report) == {(0, LF, Kind.OFF_ENVIRONMENT)}
    assert "3.5 mm" in str(report.violations[0])


def test_patch_is_held_by_its_orientation_and_its_corners(hyq: Hyq) -> None:
    foot = hyq.feet["lf"]
    assert checked(document([planar(hyq, foot, yaw=np.deg2rad(0.55))], hyq)).valid
    turned = checked(document([planar(hyq, foot, yaw=np.deg2rad(0.65))], hyq))
    assert found(turned) == {(0, LF, Kind.CONTACT_POSE)}
    lifted = planar(hyq, foot)
    corner = contact_of({"states": [lifted]}, 0, "lf")["points"][2]
    corner[2] += 0.002
    assert found(checked(document([hyq.refresh(lifted)], hyq))) == {(0, LF, Kind.CONTACT_POINTS)}
    beside = planar(hyq, foot)
    contact = contact_of({"states": [beside]}, 0, "lf")
    contact["points"] = shifted(contact["points"], 0.03)
    wanted = {(0, LF, Kind.CONTACT_POINTS), (0, LF, Kind.OFF_ROBOT)}
    assert found(checked(document([hyq.refresh(beside)], hyq))) == wanted


def test_a_patch_is_no_larger_than_the_foot(hyq: Hyq) -> None:
    """Forces act at its corners, so that a larger patch would hold more than the foot can."""
    assert checked(document([planar(hyq, hyq.feet["lf"], half=0.015)], hyq)).valid
    report = checked(document([planar(hyq, hyq.feet["lf"], half=0.018)], hyq))
    assert found(report) == {(0, LF, Kind.OFF_ROBOT)}
    corner = np.hypot(np.hypot(0.018, 0.018), RADIUS) - RADIUS  # to the ball
    assert f"contact point {1e3 * corner:.1f} mm from the robot's own" in str(report.violations[0])


def test_a_point_apart_from_the_foot(hyq: Hyq) -> None:
    """A frame offset can place a contact anywhere, but the robot has to reach it."""
    for below, valid in ((0.009, True), (0.011, False)):
        feet = {**hyq.feet, "lf": hyq.feet["lf"] + up(below)}
        state = hyq.state((0, 0), feet)
        contact = next(c for c in state["contacts"] if c["limb"] == LF)
        offset = np.array(contact["frame_offset"]["position"])
        grown = offset * (1 + below / np.linalg.norm(offset))
        contact["frame_offset"]["position"] = grown.tolist()
        contact["position"] = hyq.feet["lf"].tolist()
        contact["points"] = [contact["position"]]
        report = checked(document([hyq.refresh(state)], hyq))
        assert found(report) == (set() if valid else {(0, LF, Kind.OFF_ROBOT)})


def test_without_srdf_neighbouring_joints_are_left_out(clean: Document, hyq: Hyq) -> None:
    plan = copy.deepcopy(clean)
    plan["robot"]["srdf"] = None
    assert checked(plan).valid
    leg_through_leg(plan, hyq)
    assert found(checked(plan)) == {(1, "", Kind.SELF_COLLISION)}


@pytest.mark.parametrize(
    ("urdf", "frame", "link"),
    [
        (URDF, "lf_foot", "lf_foot"),
        (URDF, "lf_foot_joint", "lf_foot"),
        (TALOS, "left_sole_link", "leg_left_6_link"),
    ],
)
def test_the_link_at_a_contact(urdf: str, frame: str, link: str) -> None:
    model = pin.buildModelFromUrdf(str(find_resource(urdf, "urdf")), pin.JointModelFreeFlyer())
    names = tuple(model.names)[2:]
    robot = Robot(RobotEntry(name="robot", urdf=urdf, joint_names=names))
    standing = robot.contact_link(robot.frame(frame, "frame"))
    assert robot.model.frames[standing].name == link


def _set(path: str, value: Any) -> Mutation:
    def mutate(plan: Document, hyq: Hyq) -> None:
        *parents, last = [int(p) if p.isdigit() else p for p in path.split(".")]
        target: Any = plan
        for key in parents:
            target = target[key]
        target[last] = value

    return mutate


INVALID: list[tuple[str, Any, str]] = [
    ("robot.urdf", "nowhere/robot.urdf", "robot.urdf"),
    ("robot.urdf", GROUND, "robot.urdf"),
    ("robot.srdf", "nowhere/robot.srdf", "robot.srdf"),
    ("robot.joint_names.3", "tail", "robot.joint_names"),
    ("robot.joint_names.3", "lf_haa_joint", "robot.joint_names"),
    ("robot.joint_names", ["lf_haa_joint"], "robot.joint_names"),
    ("environment.meshes.0.file", "nowhere/mesh.stl", "environment.meshes.0.file"),
    ("environment.meshes.0.file", SRDF, "environment.meshes.0.file"),
    (
        "environment.meshes.0.rotation",
        [[-1, 0, 0], [0, 1, 0], [0, 0, 1]],
        "environment.meshes.0.rotation",
    ),
    ("environment.meshes", [], "environment"),
    ("states.3.contacts.0.frame", "left_wing", "states.3.contacts.0.frame"),
    ("states.3.contacts.0.frame", "universe", "states.3.contacts.0.frame"),
    ("states.1.joints", [0.0], "states.1.joints"),
    ("states.2.root.orientation", [0, 0, 0, 0], "states.2.root"),
]


@pytest.mark.parametrize(("path", "value", "field"), INVALID)
def test_errors_name_the_field(
    clean: Document, hyq: Hyq, path: str, value: Any, field: str
) -> None:
    plan = copy.deepcopy(clean)
    _set(path, value)(plan, hyq)
    with pytest.raises(InvalidInput) as caught:
        checked(plan)
    assert caught.value.field == field


def test_sixty_states_take_little_time(hyq: Hyq, clean: Document) -> None:
    plan = copy.deepcopy(clean)
    plan["states"] = [plan["states"][3]] * 60
    plan["request"]["start"] = plan["request"]["goal"]
    start = time.perf_counter()
    report = checked(plan)
    assert report.valid
    assert time.perf_counter() - start < 5.0  # about 0.5 s on an idle machine
