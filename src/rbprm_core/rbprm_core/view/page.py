"""A self-contained HTML page in which the robot moves through a plan."""

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

from rbprm_core.arrays import Array
from rbprm_core.errors import InvalidInput
from rbprm_core.plan_record import ContactPlan
from rbprm_core.view.mesh_operations import joined, sharp_edges, thinned
from rbprm_core.view.page_footprints import layers, number_mesh, patch_mesh
from rbprm_core.view.palette import BODY, GROUND, GROUND_EDGE, GUIDE, limb_colors
from rbprm_core.view.plan_geometry import PlanGeometry, load_plan_geometry

MAX_FRAMES = 720  # frames of the animation; file size and rendering time grow with them
MAX_STEPS = 6  # frames from one state to the next
FINE_LINK = 20_000  # triangles; meshes of links with more are thinned to the millimetre
LIFT = 0.003  # metres of footprints above the ground, which would otherwise hide them
LAYER = 0.0012  # metres of a footprint above an earlier one that it overlaps
NUMBER_LIFT = 0.0006  # metres of a number above its footprint
FIELD_OF_VIEW = 35.0  # degrees, vertical

# Forbids the page to load anything: it must look the same from a disk without a network.
POLICY = (
    "default-src 'none'; script-src 'unsafe-inline' 'unsafe-eval' blob:; "
    "style-src 'unsafe-inline'; img-src data: blob:; font-src data:; worker-src blob:"
)


def write_page(plan: ContactPlan, path: str | Path) -> None:
    """Write a self-contained page: environment, guide, numbered footprints, robot in motion.

    The motion between states is interpolated for display only, and the page says so.

    Args:
        plan: plan to show.
        path: path of the HTML file.

    Raises:
        InvalidInput: the plan cannot be shown (see `load_plan_geometry`), or the file cannot be
            written.
    """
    geometry = load_plan_geometry(plan)
    plot = _empty_plot(geometry)
    colors = limb_colors(geometry.limbs)
    _add_environment(plot, geometry)
    _add_footprints(plot, geometry, colors)
    _add_robot(plot, geometry, colors)
    text = plot.get_snapshot(additional_js_code="startPlayer(K3DInstance);")
    try:
        Path(path).write_text(_with_player(text, plan, geometry, colors), encoding="utf-8")
    except OSError as error:
        raise InvalidInput("out", str(path), f"cannot be written: {error.strerror}") from error


def _hex(color: str) -> int:
    """Return a colour "#rrggbb" as a number."""
    return int(color.removeprefix("#"), 16)


def _empty_plot(geometry: PlanGeometry) -> Plot:
    """Return a plot with camera and grid, without objects."""
    low, high = _extent(geometry)
    return k3d.plot(
        name="contact plan",
        camera_auto_fit=False,
        camera=_camera(geometry),
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


def _extent(geometry: PlanGeometry) -> tuple[Array, Array]:
    """Return the lowest and highest corner of the box in which the motion takes place, metres."""
    places = [geometry.roots, geometry.guide, *(f.position[None] for f in geometry.footprints)]
    points = np.vstack(places)
    low: Array = points.min(axis=0) - np.array([0.8, 0.8, 0])
    high: Array = points.max(axis=0) + np.array([0.8, 0.8, 0.5])
    return low, high


def _camera(geometry: PlanGeometry) -> list[float]:
    """Return position, target and up vector of a camera that sees the whole path from its right."""
    low, high = _extent(geometry)
    center, extent = (low + high) / 2, high - low
    # the longer side of the box lies across the screen
    ahead = np.array([1.0, 0, 0]) if extent[0] >= extent[1] else np.array([0, 1.0, 0])
    if (geometry.roots[-1] - geometry.roots[0]) @ ahead < 0:
        ahead = -ahead
    right = np.cross(ahead, [0, 0, 1])
    aim = 0.85 * right - 0.22 * ahead + np.array([0, 0, 0.55])
    # half the screen's width is about 1.6 times the half height at this distance
    half = max(extent[:2].max() / 2 / 1.6, np.linalg.norm(extent[1:]) / 2.4)
    distance = 0.95 * half / np.tan(np.deg2rad(FIELD_OF_VIEW / 2))
    position = center + distance * aim / np.linalg.norm(aim)
    return [*position.tolist(), *center.tolist(), 0, 0, 1]


def _add_environment(plot: Plot, geometry: PlanGeometry) -> None:
    """Add the environment with its sharp edges, and the guide path."""
    ground = geometry.environment
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
    if len(geometry.guide) > 1:
        line = geometry.guide.astype(np.float32)
        plot += k3d.line(line, shader="mesh", width=0.012, color=_hex(GUIDE), name="guide")


def _mesh(mesh: trimesh.Trimesh, color: str, name: str) -> k3d.objects.Mesh:
    """Return a mesh for the plot."""
    return k3d.mesh(
        np.array(mesh.vertices, np.float32),
        np.array(mesh.faces, np.uint32),
        color=_hex(color),
        side="double",
        name=name,
    )


def _add_robot(plot: Plot, geometry: PlanGeometry, colors: dict[str, str]) -> None:
    """Add the links with their placements over time; time 1.0 is state 1."""
    gaps = max(1, len(geometry.configurations) - 1)
    steps = int(np.clip(MAX_FRAMES // gaps, 1, MAX_STEPS))
    frames = geometry.placements(geometry.interpolated(steps)).astype(np.float32)
    for i, link in enumerate(geometry.links):
        mesh = link.mesh
        if len(mesh.faces) > FINE_LINK:
            mesh = thinned(mesh, digits=3)
        name = f"link of {geometry.model.names[link.joint]}"
        item = _mesh(mesh, colors.get(link.limb, BODY), name)
        item.model_matrix = {str(k / steps): frame[i] for k, frame in enumerate(frames)}
        plot += item


def _add_footprints(plot: Plot, geometry: PlanGeometry, colors: dict[str, str]) -> None:
    """Add footprints in the colours of their limbs, each with the number of its state."""
    position, target = np.reshape(_camera(geometry)[:6], (2, 3))
    across = np.cross(target - position, [0, 0, 1])
    patches: dict[str, list[trimesh.Trimesh]] = {}
    numbers: list[trimesh.Trimesh] = []
    for mark, layer in zip(geometry.footprints, layers(geometry.footprints), strict=True):
        lift = (LIFT + LAYER * layer) * mark.normal
        patches.setdefault(mark.limb, []).append(patch_mesh(mark).apply_translation(lift))
        above = lift + NUMBER_LIFT * mark.normal
        numbers.append(number_mesh(mark, across).apply_translation(above))
    for limb, meshes in patches.items():
        plot += _mesh(joined(meshes), colors[limb], f"footprints of {limb}")
    if numbers:
        plot += _mesh(joined(numbers), "#ffffff", "state numbers")


def _with_player(
    text: str, plan: ContactPlan, geometry: PlanGeometry, colors: dict[str, str]
) -> str:
    """Return the snapshot of k3d with title, content security policy and player added."""
    data = {
        "threshold": plan.request.robustness_threshold,
        "robustness": [state.robustness for state in plan.states],
        "contacts": [[c.limb for c in state.contacts] for state in plan.states],
        "roots": geometry.roots.round(4).tolist(),
        "colors": colors,
    }
    name = (
        f"{plan.robot.name} on {plan.environment.name}"
        if plan.environment.name
        else plan.robot.name
    )
    player = (files("rbprm_core.view") / "player.html").read_text(encoding="utf-8")
    # without "<" a name in the plan cannot end the script element
    player = player.replace("[PLAN]", json.dumps(data).replace("<", "\\u003c"))
    player = player.replace("[NAME]", html.escape(name))
    head, _, body = text.partition("<head>")
    policy = f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">'
    title = f"<title>{html.escape(name)}: contact plan</title>"
    body = re.sub("<title>.*?</title>", lambda _: title, body, count=1)
    return f"{head}<head>\n{policy}\n{body}".replace("<body>", f"<body>\n{player}", 1)
