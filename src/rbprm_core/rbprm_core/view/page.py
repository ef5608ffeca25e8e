"""One HTML file in which the robot walks through a plan, with all that it needs inside."""

from __future__ import annotations

import html
import json
import re
from importlib.resources import files
from pathlib import Path

import k3d
import numpy as np
import trimesh
from k3d.plot import Plot
from matplotlib.font_manager import FontProperties
from matplotlib.textpath import TextPath
from numpy.typing import NDArray
from shapely import MultiPolygon, Polygon

from rbprm_core.errors import InvalidInput
from rbprm_core.plan_record import ContactPlan
from rbprm_core.view.meshes import flat_mesh, frame_on, joined, sharp_edges, thinned
from rbprm_core.view.palette import BODY, GROUND, GROUND_EDGE, GUIDE, limb_colors
from rbprm_core.view.scene import Footprint, PlanScene, make_scene

Array = NDArray[np.float64]

MAX_FRAMES = 720  # of the animation; the file and the player's work grow with them
MAX_STEPS = 6  # frames from a state to the next
FINE_LINK = 20_000  # triangles; a link with more is thinned to the millimetre
DISC = 0.045  # radius in metres of the mark of a point contact
LIFT = 0.003  # metres that marks float above the ground, which would else hide them
LAYER = 0.0012  # metres that a mark lies above an earlier one that it overlaps
INK = 0.0006  # metres from a mark to the number on it
FIELD_OF_VIEW = 35.0  # degrees, vertical

# What leaves no way to fetch anything: a page from disk must look the same without a network.
POLICY = (
    "default-src 'none'; script-src 'unsafe-inline' 'unsafe-eval' blob:; "
    "style-src 'unsafe-inline'; img-src data: blob:; font-src data:; worker-src blob:"
)


def write_page(plan: ContactPlan, path: str | Path) -> None:
    """Write a self-contained page: scene, guide, numbered footprints and the robot in motion.

    Between the states of the plan the robot is interpolated for the eye; the page says so.

    Raises:
        InvalidInput: the plan cannot be shown (see `make_scene`) or the file cannot be written.
    """
    scene = make_scene(plan)
    plot = _empty_plot(scene)
    colors = limb_colors(scene.limbs)
    _add_ground(plot, scene)
    _add_footprints(plot, scene, colors)
    _add_robot(plot, scene, colors)
    text = plot.get_snapshot(additional_js_code="startPlayer(K3DInstance);")
    try:
        Path(path).write_text(_with_player(text, plan, scene, colors), encoding="utf-8")
    except OSError as error:
        raise InvalidInput("out", str(path), f"cannot be written: {error.strerror}") from error


def _hex(color: str) -> int:
    return int(color.removeprefix("#"), 16)


def _empty_plot(scene: PlanScene) -> Plot:
    low, high = _stage(scene)
    return k3d.plot(
        name="contact plan",
        camera_auto_fit=False,
        camera=_camera(scene),
        camera_fov=FIELD_OF_VIEW,
        camera_mode="orbit",
        camera_up_axis="z",
        grid_auto_fit=False,
        grid=(*low, *high),
        axes=["x [m]", "y [m]", "z [m]"],
        axes_helper=0,
        background_color=0xFBFBF9,
        grid_color=0xE3E3DF,
        label_color=0x777777,
        menu_visibility=False,
        snapshot_type="full",
    )


def _stage(scene: PlanScene) -> tuple[Array, Array]:
    """Lowest and highest corner of the box in which the walk takes place, metres."""
    places = [scene.roots, scene.guide, *(f.position[None] for f in scene.footprints)]
    points = np.vstack(places)
    low: Array = points.min(axis=0) - np.array([0.8, 0.8, 0])
    high: Array = points.max(axis=0) + np.array([0.8, 0.8, 0.5])
    return low, high


def _camera(scene: PlanScene) -> list[float]:
    """Position, target and up: from the right of the way and above, the whole way in view."""
    low, high = _stage(scene)
    center, extent = (low + high) / 2, high - low
    # the longer side of the stage lies across the screen
    ahead = np.array([1.0, 0, 0]) if extent[0] >= extent[1] else np.array([0, 1.0, 0])
    if (scene.roots[-1] - scene.roots[0]) @ ahead < 0:
        ahead = -ahead
    right = np.cross(ahead, [0, 0, 1])
    aim = 0.85 * right - 0.22 * ahead + np.array([0, 0, 0.55])
    # half the screen's width is about 1.6 times the half height at this distance
    half = max(extent[:2].max() / 2 / 1.6, np.linalg.norm(extent[1:]) / 2.4)
    distance = 0.95 * half / np.tan(np.deg2rad(FIELD_OF_VIEW / 2))
    position = center + distance * aim / np.linalg.norm(aim)
    return [*position.tolist(), *center.tolist(), 0, 0, 1]


def _add_ground(plot: Plot, scene: PlanScene) -> None:
    """Environment with its sharp edges, and the guide path."""
    ground = scene.environment
    if not ground.is_empty:
        plot += _mesh(ground, GROUND, "environment")
        edges = sharp_edges(ground)
        if len(edges):
            indices = np.arange(2 * len(edges)).reshape(-1, 2)
            plot += k3d.lines(
                edges.reshape(-1, 3).astype(np.float32),
                indices.astype(np.uint32),
                indices_type="segment",
                shader="simple",
                color=_hex(GROUND_EDGE),
                name="edges",
            )
    if len(scene.guide) > 1:
        line = scene.guide.astype(np.float32)
        plot += k3d.line(line, shader="mesh", width=0.012, color=_hex(GUIDE), name="guide")


def _mesh(mesh: trimesh.Trimesh, color: str, name: str) -> k3d.objects.Mesh:
    return k3d.mesh(
        np.array(mesh.vertices, np.float32),
        np.array(mesh.faces, np.uint32),
        color=_hex(color),
        side="double",
        name=name,
    )


def _add_robot(plot: Plot, scene: PlanScene, colors: dict[str, str]) -> None:
    """The links, moving; time 1.0 is state 1."""
    gaps = max(1, len(scene.configurations) - 1)
    steps = int(np.clip(MAX_FRAMES // gaps, 1, MAX_STEPS))
    frames = scene.placements(scene.between(steps)).astype(np.float32)
    for i, link in enumerate(scene.links):
        mesh = link.mesh
        if len(mesh.faces) > FINE_LINK:
            mesh = thinned(mesh, digits=3)
        item = _mesh(mesh, colors.get(link.limb, BODY), f"link of {scene.model.names[link.joint]}")
        item.model_matrix = {str(k / steps): frame[i] for k, frame in enumerate(frames)}
        plot += item


def _add_footprints(plot: Plot, scene: PlanScene, colors: dict[str, str]) -> None:
    """Patches in the limbs' colours, each with the number of the state that makes it."""
    position, target = np.reshape(_camera(scene)[:6], (2, 3))
    across = np.cross(target - position, [0, 0, 1])
    patches: dict[str, list[trimesh.Trimesh]] = {}
    numbers: list[trimesh.Trimesh] = []
    for mark, level in zip(scene.footprints, _levels(scene.footprints), strict=True):
        lift = (LIFT + LAYER * level) * mark.normal
        patches.setdefault(mark.limb, []).append(_patch(mark).apply_translation(lift))
        numbers.append(_number(mark, across).apply_translation(lift + INK * mark.normal))
    for limb, meshes in patches.items():
        plot += _mesh(joined(meshes), colors[limb], f"footprints of {limb}")
    if numbers:
        plot += _mesh(joined(numbers), "#ffffff", "state numbers")


def _levels(marks: tuple[Footprint, ...]) -> list[int]:
    """How many marks lie under each one, so that a later one covers an earlier one whole."""
    centers = np.array([mark.position for mark in marks]).reshape(-1, 3)
    radii = np.array([mark.radius or DISC for mark in marks])
    levels = np.zeros(len(marks), dtype=int)
    for i in range(len(marks)):
        near = np.linalg.norm(centers[:i] - centers[i], axis=1) < radii[:i] + radii[i]
        levels[i] = 1 + levels[:i][near].max(initial=-1)
    return levels.tolist()


def _patch(mark: Footprint) -> trimesh.Trimesh:
    """A disc about a point contact, the patch itself of a planar one."""
    if not len(mark.corners):
        turns = np.linspace(0, 2 * np.pi, 33)[:-1]
        circle = DISC * np.column_stack((np.cos(turns), np.sin(turns), np.zeros(len(turns))))
        rim = trimesh.transform_points(circle, frame_on(mark.position, mark.normal))
    else:
        rim = mark.corners
    return trimesh.Trimesh(rim, [[0, k, k + 1] for k in range(1, len(rim) - 1)])


def _number(mark: Footprint, across: Array) -> trimesh.Trimesh:
    """The state's number painted on the patch."""
    return _digits(str(mark.state)).apply_transform(frame_on(mark.position, mark.normal, across))


def _digits(text: str) -> trimesh.Trimesh:
    """Triangles of a text in the plane z = 0, centred, to fit the disc."""
    size = DISC * (1.15 if len(text) < 3 else 0.85)
    path = TextPath(
        (0, 0), text, size=100, prop=FontProperties(family="DejaVu Sans", weight="bold")
    )
    # overlapping loops cancel: the hole of a zero is what is left out
    shape = MultiPolygon()
    for loop in path.to_polygons():
        shape = shape.symmetric_difference(Polygon(loop))
    pieces = [shape] if isinstance(shape, Polygon) else list(shape.geoms)
    mesh = joined([flat_mesh(piece) for piece in pieces])
    mesh.apply_translation(-mesh.bounds.mean(axis=0))
    return mesh.apply_transform(np.diag([size / 100, size / 100, 1, 1]))


def _with_player(text: str, plan: ContactPlan, scene: PlanScene, colors: dict[str, str]) -> str:
    """The snapshot of k3d with our title, policy and player in it."""
    data = {
        "threshold": plan.request.robustness_threshold,
        "robustness": [state.robustness for state in plan.states],
        "contacts": [[c.limb for c in state.contacts] for state in plan.states],
        "roots": scene.roots.round(4).tolist(),
        "colors": colors,
    }
    name = (
        f"{plan.robot.name} on {plan.environment.name}"
        if plan.environment.name
        else plan.robot.name
    )
    player = (files("rbprm_core.view") / "player.html").read_text(encoding="utf-8")
    # "<" would let a name of the plan end the script element
    player = player.replace("[PLAN]", json.dumps(data).replace("<", "\\u003c"))
    player = player.replace("[NAME]", html.escape(name))
    head, _, body = text.partition("<head>")
    policy = f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">'
    title = f"<title>{html.escape(name)}: contact plan</title>"
    body = re.sub("<title>.*?</title>", lambda _: title, body, count=1)
    return f"{head}<head>\n{policy}\n{body}".replace("<body>", f"<body>\n{player}", 1)
