"""A plausible plan made without the planner: HyQ crawls over the rubble."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pinocchio as pin
import pytest
import trimesh

from rbprm_core.arrays import Array
from rbprm_core.plan_record import ContactPlan
from rbprm_core.resources import find_resource

URDF = "example-robot-data/robots/hyq_description/robots/hyq_no_sensors.urdf"
RUBBLE = "hpp_environments/meshes/multicontact/darpareduced.stl"
LEGS = ("rh", "rf", "lh", "lf")  # the order of a crawl
RADIUS = 0.02175  # metres, of the balls that are the feet
START, STEP = -1.3, 0.035  # metres: x of the root in the first state, and between states
FOOT_X, FOOT_Y, HEIGHT = 0.37, 0.32, 0.55  # metres, from the root to a foot in the stance


class Crawler:
    """Places HyQ's feet on the rubble and solves for the joints of the legs."""

    def __init__(self) -> None:
        self.model = pin.buildModelFromUrdf(
            str(find_resource(URDF, "urdf")), pin.JointModelFreeFlyer()
        )
        self.data = self.model.createData()
        self.ground = trimesh.load_mesh(find_resource(RUBBLE, "mesh"))
        self.q = pin.neutral(self.model)
        for leg in LEGS:
            bend = 1 if leg[1] == "f" else -1
            first = self.model.joints[self.model.getJointId(f"{leg}_haa_joint")].idx_q
            self.q[first : first + 3] = [-0.2, 0.75 * bend, -1.5 * bend]

    def foothold(self, leg: str, x: float) -> tuple[Array, Array]:
        """Point and normal of the ground under a foot of the stance, for the root at x."""
        y = FOOT_Y if leg[0] == "l" else -FOOT_Y
        above = [x + (FOOT_X if leg[1] == "f" else -FOOT_X), y, 5.0]
        hits, _, faces = self.ground.ray.intersects_location([above], [[0, 0, -1]])
        top = np.argmax(hits[:, 2])
        normal = self.ground.face_normals[faces[top]]
        return hits[top], normal * np.sign(normal[2])

    def reach(self, root: Array, feet: dict[str, tuple[Array, Array]]) -> None:
        """Move each leg to its foothold by Gauss-Newton steps."""
        self.q[:3] = root
        for leg, (point, normal) in feet.items():
            frame = self.model.getFrameId(f"{leg}_foot")
            joint = self.model.joints[self.model.getJointId(f"{leg}_haa_joint")]
            for _ in range(20):
                pin.computeJointJacobians(self.model, self.data, self.q)
                pin.updateFramePlacements(self.model, self.data)
                error = point + RADIUS * normal - self.data.oMf[frame].translation
                jacobian = pin.getFrameJacobian(
                    self.model, self.data, frame, pin.LOCAL_WORLD_ALIGNED
                )[:3, joint.idx_v : joint.idx_v + 3]
                step = jacobian.T @ np.linalg.solve(jacobian @ jacobian.T + 1e-4 * np.eye(3), error)
                self.q[joint.idx_q : joint.idx_q + 3] += step

    def state(self, feet: dict[str, tuple[Array, Array]], robustness: float) -> dict[str, object]:
        """The current configuration as a state of the plan file."""
        upright = [0.0, 0.0, 0.0, 1.0]
        contacts = [
            {
                "limb": f"{leg}_leg",
                "frame": f"{leg}_foot",
                "type": "point",
                "position": point.tolist(),
                "orientation": upright,
                "normal": normal.tolist(),
                "points": [point.tolist()],
                "friction": 0.5,
            }
            for leg, (point, normal) in feet.items()
        ]
        return {
            "root": {"position": self.q[:3].tolist(), "orientation": upright},
            "joints": self.q[7:].tolist(),
            "com": self.q[:3].tolist(),
            "robustness": robustness,
            "contacts": contacts,
        }


def crawl(count: int) -> ContactPlan:
    """A plan of `count` states; every other state has a swing foot."""
    crawler = Crawler()
    feet = {leg: crawler.foothold(leg, START) for leg in LEGS}
    states = []
    for i in range(count):
        x = START + STEP * i
        leg = LEGS[(i - 1) // 2 % 4]
        lifted = i % 2 == 1
        if lifted:
            feet[leg] = crawler.foothold(leg, x + 0.1)
        height = HEIGHT + float(np.mean([point[2] for point, _ in feet.values()]))
        crawler.reach(np.array([x, 0, height]), feet)
        held = {name: foot for name, foot in feet.items() if not (lifted and name == leg)}
        states.append(crawler.state(held, 18 + 9 * np.sin(0.7 * i) - (6 if lifted else 0)))
    poses = [s["root"] for s in states]
    return ContactPlan.model_validate(
        {
            "robot": {"name": "hyq", "urdf": URDF, "joint_names": list(crawler.model.names[2:])},
            "environment": {"name": "rubble", "meshes": [{"file": RUBBLE}]},
            "request": {"start": poses[0], "goal": poses[-1], "robustness_threshold": 10.0},
            "guide": poses[::4],
            "states": states,
        }
    )


@pytest.fixture(scope="session")
def plan() -> ContactPlan:
    """A short plan."""
    return crawl(13)


def _without_states(plan: ContactPlan) -> ContactPlan:
    return plan.model_copy(update={"states": ()})


def _unknown_robot(plan: ContactPlan) -> ContactPlan:
    return plan.model_copy(update={"robot": plan.robot.model_copy(update={"urdf": "no/such.urdf"})})


def _unknown_joint(plan: ContactPlan) -> ContactPlan:
    names = ("no_such_joint", *plan.robot.joint_names[1:])
    return plan.model_copy(update={"robot": plan.robot.model_copy(update={"joint_names": names})})


def _joint_missing(plan: ContactPlan) -> ContactPlan:
    short = plan.states[0].model_copy(update={"joints": plan.states[0].joints[1:]})
    return plan.model_copy(update={"states": (short, *plan.states[1:])})


@pytest.fixture(params=[_without_states, _unknown_robot, _unknown_joint, _joint_missing])
def bad_plan(request: pytest.FixtureRequest, plan: ContactPlan) -> ContactPlan:
    """A plan that cannot be shown."""
    spoil: Callable[[ContactPlan], ContactPlan] = request.param
    return spoil(plan)
