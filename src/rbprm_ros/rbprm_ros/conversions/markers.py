"""A plan and its environment as markers for RViz."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
import pinocchio as pin
from geometry_msgs.msg import Point, Pose, Quaternion, Vector3
from numpy.typing import NDArray
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker, MarkerArray

from rbprm_core.plan_record import ContactPlan
from rbprm_core.resources import find_resource
from rbprm_core.scene.triangles import fan_triangles
from rbprm_core.view.footprints import Footprint, footprints
from rbprm_core.view.palette import BAD, BODY, GROUND, GUIDE, INK, limb_colors
from rbprm_core.view.plan_geometry import configurations
from rbprm_ros.conversions.meshes import areas
from rbprm_ros.environment.snapshot import Snapshot

Array = NDArray[np.float64]

MAX_TRIANGLES = 8_000  # so that the message has less than a megabyte
MAX_LABELS = 200  # footprints with a number
SILHOUETTES = 6  # states in which the robot is drawn
SEE_THROUGH = 0.5  # opacity of surfaces
LIFT = 2e-3  # metres; keeps footprints off the surfaces that they are in
FOOT, LINE, BONE, TEXT = 0.03, 0.015, 0.02, 0.06  # diameters, widths and height, metres


def markers_message(
    header: Header, snapshot: Snapshot, plan: ContactPlan | None = None
) -> MarkerArray:
    """Markers of environment and plan; earlier markers are deleted first.

    Args:
        header: header in the planning frame.
        snapshot: the environment.
        plan: the published plan; None where there is none.

    Raises:
        InvalidInput: the plan's robot cannot be loaded.
    """
    markers = [_marker(header, "", 0, action=Marker.DELETEALL)]
    markers += _environment(header, snapshot)
    if plan is not None and plan.states:
        feet = footprints(plan.states)
        limbs = tuple(dict.fromkeys(foot.limb for foot in feet))
        colors = {limb: _color(text) for limb, text in limb_colors(limbs).items()}
        markers += [*_guide(header, plan), *_feet(header, feet, colors), *_labels(header, feet)]
        markers += _silhouettes(header, plan)
    return MarkerArray(markers=markers)


def _environment(header: Header, snapshot: Snapshot) -> list[Marker]:
    surfaces = fan_triangles([piece for s in snapshot.surfaces for piece in s.polygon.pieces])
    obstacles = [obstacle.triangles for obstacle in snapshot.obstacles]
    triangles = np.concatenate([np.zeros((0, 3, 3)), *obstacles])
    rest = max(MAX_TRIANGLES - len(surfaces), 0)
    drawn = (
        ("surfaces", _largest(surfaces, MAX_TRIANGLES), _color(GROUND, SEE_THROUGH)),
        ("obstacles", _largest(triangles, rest), _color(BAD, SEE_THROUGH)),
    )
    return [_triangles(header, name, part, color) for name, part, color in drawn if len(part)]


def _largest(triangles: Array, most: int) -> Array:
    """The largest triangles (n, 3, 3), all of them if they are no more than so many."""
    if len(triangles) <= most:
        return triangles
    return triangles[np.sort(np.argsort(-areas(triangles), kind="stable")[:most])]


def _triangles(header: Header, name: str, triangles: Array, color: ColorRGBA) -> Marker:
    points = _points(triangles.reshape(-1, 3))
    scale = _scale(1.0, 1.0, 1.0)
    kind = Marker.TRIANGLE_LIST
    return _marker(header, name, 0, type=kind, scale=scale, color=color, points=points)


def _guide(header: Header, plan: ContactPlan) -> list[Marker]:
    if len(plan.guide) < 2:
        return []
    points = _points([pose.position for pose in plan.guide])
    kind, scale, color = Marker.LINE_STRIP, _scale(LINE), _color(GUIDE)
    return [_marker(header, "guide", 0, type=kind, scale=scale, color=color, points=points)]


def _feet(header: Header, feet: Sequence[Footprint], colors: dict[str, ColorRGBA]) -> list[Marker]:
    """Point contacts as balls, and patches as flat polygons, in the colours of their limbs."""
    balls = [foot for foot in feet if not len(foot.corners)]
    markers = []
    if balls:
        points = _points([foot.position for foot in balls])
        kind, scale = Marker.SPHERE_LIST, _scale(FOOT, FOOT, FOOT)
        tints = [colors[foot.limb] for foot in balls]
        markers.append(
            _marker(header, "points", 0, type=kind, scale=scale, points=points, colors=tints)
        )
    patches = [foot for foot in feet if len(foot.corners)]
    if patches:
        rings = [foot.corners + LIFT * foot.normal for foot in patches]
        # a polygon of n corners is n - 2 triangles
        tints = [colors[f.limb] for f in patches for _ in range(3 * (len(f.corners) - 2))]
        marker = _triangles(header, "patches", fan_triangles(rings), _color(INK))
        marker.colors = tints
        markers.append(marker)
    return markers


def _labels(header: Header, feet: Sequence[Footprint]) -> list[Marker]:
    """Numbers over the contacts: the index of the state that makes each one."""
    scale, color = Vector3(z=TEXT), _color(INK)
    return [
        _marker(
            header,
            "labels",
            i,
            type=Marker.TEXT_VIEW_FACING,
            pose=_pose(foot.position + TEXT * foot.normal),
            scale=scale,
            color=color,
            text=str(foot.state),
        )
        for i, foot in enumerate(feet[:MAX_LABELS])
    ]


def _silhouettes(header: Header, plan: ContactPlan) -> list[Marker]:
    """Skeletons of the robot in some states, with first and last; later ones are more opaque."""
    model = _model(plan.robot.urdf)
    data = model.createData()
    chosen = np.unique(np.linspace(0, len(plan.states) - 1, SILHOUETTES).round().astype(int))
    rows = configurations(model, plan)
    markers = []
    for i, index in enumerate(chosen.tolist()):
        pin.framesForwardKinematics(model, data, rows[index])
        points = _points(_bones(model, data, plan, index))
        color = _color(BODY, (i + 1) / len(chosen))
        kind, scale = Marker.LINE_LIST, _scale(BONE)
        markers.append(
            _marker(header, "robot", i, type=kind, scale=scale, color=color, points=points)
        )
    return markers


def _bones(model: pin.Model, data: pin.Data, plan: ContactPlan, state: int) -> Array:
    """Ends (2 n, 3) of the lines from joint to joint, and from the last joints to the contacts."""
    origins = np.array([placement.translation for placement in data.oMi])
    parents = np.array(model.parents)
    joints = np.arange(2, model.njoints)  # those below the root
    ends = [np.stack([origins[parents[joints]], origins[joints]], axis=1).reshape(-1, 3)]
    for contact in plan.states[state].contacts:
        joint = model.frames[model.getFrameId(contact.frame)].parentJoint
        ends.append(np.array([origins[joint], contact.position]))
    return np.concatenate(ends)


@lru_cache(maxsize=16)
def _model(urdf: str) -> pin.Model:
    path = find_resource(urdf, "robot.urdf")
    return pin.buildModelFromUrdf(str(path), pin.JointModelFreeFlyer())


def _marker(header: Header, namespace: str, identity: int, **fields: Any) -> Marker:
    if "pose" not in fields:
        fields["pose"] = _pose((0, 0, 0))
    return Marker(header=header, ns=namespace, id=identity, **fields)


def _pose(position: Iterable[float]) -> Pose:
    x, y, z = map(float, position)
    return Pose(position=Point(x=x, y=y, z=z), orientation=Quaternion(w=1.0))


def _points(rows: Any) -> list[Point]:
    return [Point(x=x, y=y, z=z) for x, y, z in np.asarray(rows, dtype=float).tolist()]


def _scale(x: float, y: float = 0.0, z: float = 0.0) -> Vector3:
    return Vector3(x=x, y=y, z=z)


def _color(text: str, opacity: float = 1.0) -> ColorRGBA:
    r, g, b = (int(text[i : i + 2], 16) / 255 for i in (1, 3, 5))
    return ColorRGBA(r=r, g=g, b=b, a=opacity)
