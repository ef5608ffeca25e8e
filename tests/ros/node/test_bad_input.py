"""Invalid input is answered with an error that names the field; the node keeps running."""

from __future__ import annotations

import math
import shutil
from collections.abc import Callable
from copy import deepcopy
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from geometry_msgs.msg import Point, Quaternion
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rbprm_msgs.msg import PlanningResult, PolygonRing, Surface, SurfaceArray
from rbprm_msgs.srv import ListRobots, Plan
from tests.ros.conftest import ENDLESS

if TYPE_CHECKING:
    from conftest import Executive, Site

Spoil = Callable[[Plan.Request], None]
SpoilSurfaces = Callable[[SurfaceArray], None]

NAN, INF = math.nan, math.inf


def put(path: str, value: object) -> Callable[[object], None]:
    """Sets the field of a message that a dotted path names."""

    def spoil(message: object) -> None:
        *parents, last = path.split(".")
        for name in parents:
            message = message[int(name)] if name.isdigit() else getattr(message, name)  # type: ignore[index]
        setattr(message, last, value)

    return spoil


REQUESTS: list[tuple[str, Spoil, str]] = [
    ("nan position", put("start.pose.position.x", NAN), "start.pose.position"),
    ("infinite position", put("goal.pose.position.z", INF), "goal.pose.position"),
    ("zero quaternion", put("start.pose.orientation", Quaternion(w=0.0)), "start.pose.orientation"),
    ("long quaternion", put("goal.pose.orientation", Quaternion(w=2.0)), "goal.pose.orientation"),
    ("nan quaternion", put("goal.pose.orientation.x", NAN), "goal.pose.orientation"),
    ("frame", put("start.header.frame_id", "odom"), "start.header.frame_id"),
    ("goal frame", put("goal.header.frame_id", "base_link"), "goal.header.frame_id"),
    ("negative time", put("time_limit", -1.0), "time_limit"),
    ("nan time", put("time_limit", NAN), "time_limit"),
    ("infinite time", put("time_limit", INF), "time_limit"),
    ("negative robustness", put("robustness_threshold", -1.0), "robustness_threshold"),
    ("nan robustness", put("robustness_threshold", NAN), "robustness_threshold"),
    ("robot", put("robot", "spot"), "robot"),
    ("robot as a path", put("robot", "/etc/passwd"), "robot"),
    ("limb", put("required_limbs", ["lf_leg", "tail"]), "required_limbs.1"),
    ("start limb", put("start_limbs", ["wing"]), "start_limbs.0"),
    ("nan bound", put("bounds.low.x", NAN), "bounds.low"),
    ("empty bounds", put("bounds.low.y", 3.0), "bounds.low"),
    ("negative half range", put("bounds.yaw", -0.1), "bounds.yaw"),
]


@pytest.mark.parametrize(("spoil", "field"), [pytest.param(s, f, id=n) for n, s, f in REQUESTS])
def test_bad_request(
    spoil: Spoil,
    field: str,
    shared: Site,
    executive: Executive,
    ground: SurfaceArray,
    request_on_ground: Plan.Request,
) -> None:
    executive.publish(ground)
    spoil(request_on_ground)
    result = executive.call_on_surfaces(request_on_ground).result
    assert (result.code, result.field) == (PlanningResult.INVALID_INPUT, field), result.text
    assert result.value
    assert field in result.text
    assert shared.processes[0].popen.poll() is None


def triangle(*corners: tuple[float, float, float]) -> list[Point]:
    return [Point(x=float(x), y=float(y), z=float(z)) for x, y, z in corners]


def no_frame(message: SurfaceArray) -> None:
    message.header.frame_id = "camera"


def twice(message: SurfaceArray) -> None:
    message.surfaces.append(deepcopy(message.surfaces[0]))


def unknown_removed(message: SurfaceArray) -> None:
    message.is_diff, message.removed_ids = True, ["never_seen"]


LINE = triangle((0, 0, 0), (1, 0, 0), (2, 0, 0))
TWO = triangle((0, 0, 0), (1, 0, 0), (0, 0, 0))
BOW = triangle((0, 0, 0), (2, 2, 0), (2, 0, 0), (0, 3, 0))
BENT = triangle((0, 0, 0), (1, 0, 0), (1, 1, 0.3), (0, 1, 0))
HOLE = PolygonRing(vertices=triangle((8, 8, 0), (9, 8, 0), (9, 9, 0)))
HUGE = [Point(x=math.cos(i / 500), y=math.sin(i / 500)) for i in range(2000)]

SURFACES: list[tuple[str, SpoilSurfaces, str]] = [
    ("nan vertex", put("surfaces.0.vertices.1.y", NAN), "surfaces.0.vertices"),
    ("infinite vertex", put("surfaces.0.vertices.1.y", -INF), "surfaces.0.vertices"),
    ("no vertices", put("surfaces.0.vertices", []), "surfaces.0.vertices"),
    ("two points", put("surfaces.0.vertices", TWO), "surfaces.0.vertices"),
    ("zero area", put("surfaces.0.vertices", LINE), "surfaces.0.vertices"),
    ("crosses itself", put("surfaces.0.vertices", BOW), "surfaces.0.vertices"),
    ("not planar", put("surfaces.0.vertices", BENT), "surfaces.0.vertices"),
    ("hole outside", put("surfaces.0.holes", [HOLE]), "surfaces.0.vertices"),
    ("too many vertices", put("surfaces.0.vertices", HUGE), "surfaces.0.vertices"),
    ("negative friction", put("surfaces.0.friction", -0.1), "surfaces.0.friction"),
    ("nan friction", put("surfaces.0.friction", NAN), "surfaces.0.friction"),
    ("empty id", put("surfaces.0.id", ""), "surfaces.0.id"),
    ("duplicate id", twice, "surfaces.1.id"),
    ("frame", no_frame, "header.frame_id"),
    ("unknown id removed", unknown_removed, "removed_ids.0"),
    ("removal in a snapshot", put("removed_ids", ["ground"]), "removed_ids"),
]


@pytest.mark.parametrize(("spoil", "field"), [pytest.param(s, f, id=n) for n, s, f in SURFACES])
def test_bad_surfaces_change_nothing(
    spoil: SpoilSurfaces,
    field: str,
    shared: Site,
    executive: Executive,
    ground: SurfaceArray,
    request_on_ground: Plan.Request,
) -> None:
    executive.publish(ground)
    request_on_ground.goal.pose.position.x = 0.1
    assert executive.call_on_surfaces(request_on_ground).result.code == PlanningResult.SUCCESS
    spoil(ground)
    planner = shared.processes[0]
    seen = planner.log.read_text().count("surfaces refused")
    executive.publish(ground)
    planner.wait_for("surfaces refused", seen + 1)
    line = [text for text in planner.log.read_text().splitlines() if "refused" in text][-1]
    assert f": {field} = " in line
    assert executive.call(request_on_ground).result.code == PlanningResult.SUCCESS


def test_plan_without_surfaces_names_them(site: Site, request_on_ground: Plan.Request) -> None:
    site.planner()
    result = site.executive().call(request_on_ground).result
    assert (result.code, result.field) == (PlanningResult.INVALID_INPUT, "surfaces")
    assert "none were received" in result.text


def test_plan_without_surfaces_tells_why_the_last_were_refused(
    site: Site, ground: SurfaceArray, request_on_ground: Plan.Request
) -> None:
    planner, executive = site.planner(), site.executive()
    ground.surfaces[0].friction = -1.0
    executive.publish(ground)
    planner.wait_for("surfaces refused")
    result = executive.call(request_on_ground).result
    assert (result.code, result.field) == (PlanningResult.INVALID_INPUT, "surfaces")
    assert "surfaces.0.friction" in result.text


def test_empty_snapshot_leaves_nothing_to_plan_on(
    site: Site, ground: SurfaceArray, request_on_ground: Plan.Request
) -> None:
    site.planner()
    executive = site.executive()
    request_on_ground.goal.pose.position.x = 0.1
    executive.publish(ground)
    assert executive.call_on_surfaces(request_on_ground).result.code == PlanningResult.SUCCESS
    executive.publish(SurfaceArray())
    executive.spin_until(
        lambda: executive.call(request_on_ground).result.field == "surfaces", "an empty environment"
    )


def test_start_inside_an_obstacle(
    shared: Site, executive: Executive, ground: SurfaceArray, request_on_ground: Plan.Request
) -> None:
    wall = Surface(
        id="wall",
        vertices=triangle((0, -1, 0), (0, 1, 0), (0, 1, 2), (0, -1, 2)),
        friction=0.5,
    )
    ground.surfaces.append(wall)
    executive.publish(ground)
    executive.spin_until(
        lambda: executive.call(request_on_ground).result.code == PlanningResult.START_UNREACHABLE,
        "the wall",
    )


@pytest.mark.parametrize(
    ("argument", "name"),
    [("time_limit:=-1.0", "time_limit"), ("robot:=spot", "robot"), ("max_surfaces:=x", "max_surf")],
)
def test_bad_parameter_at_start(argument: str, name: str, site: Site) -> None:
    process = site.start("planner_node", "--ros-args", "-p", argument)
    assert process.popen.wait(60) == 2
    assert name in process.log.read_text()


def test_call_that_has_no_way_to_tell_an_error_is_answered(
    site: Site, quick_hyq: str, tmp_path: Path
) -> None:
    file = tmp_path / "mine.toml"
    shutil.copy(quick_hyq, file)
    planner = site.start("planner_node", "--ros-args", "-p", f"robot:={file}")
    planner.wait_for("up;")
    file.unlink()
    executive = site.executive()
    answer = executive.ask(ListRobots, "list_robots", ListRobots.Request())
    assert (answer.default_robot, answer.robots) == (str(file), [])
    assert "mine.toml" in planner.log.read_text()


def test_calls_beyond_those_that_may_wait_are_refused_at_once(
    site: Site, gap: SurfaceArray, request_over_gap: Plan.Request
) -> None:
    site.planner(*ENDLESS, "-p", "max_calls:=3")
    executive = site.executive()
    executive.give(gap)
    request_over_gap.time_limit = 300.0  # no other call is answered before the refusals
    calls = [executive.start_call(request_over_gap) for _ in range(5)]
    executive.spin_until(lambda: sum(call.done() for call in calls) == 2, "two refusals")
    refused = [call.result().result for call in calls if call.done()]
    assert {result.code for result in refused} == {PlanningResult.BUSY}
    assert "3 calls of ~/plan wait already" in refused[0].text
    for transition in (Transition.TRANSITION_DEACTIVATE, Transition.TRANSITION_ACTIVATE):
        change = ChangeState.Request(transition=Transition(id=transition))
        assert executive.ask(ChangeState, "change_state", change).success
    others = [executive.answer(call).result.code for call in calls]
    assert others.count(PlanningResult.CANCELLED) == 3
    # Calls are accepted again, as calls of other services were all the time.
    request_over_gap.time_limit = 1.0
    assert executive.call(request_over_gap).result.code == PlanningResult.TIME_LIMIT
