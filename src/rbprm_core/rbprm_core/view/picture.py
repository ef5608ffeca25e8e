"""One PNG that shows a plan at a glance: from above, from the side, and its robustness."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from rbprm_core.errors import InvalidInput
from rbprm_core.plan_record import ContactPlan
from rbprm_core.view.meshes import sharp_edges, thinned
from rbprm_core.view.palette import BAD, BODY, GROUND, GROUND_EDGE, GUIDE, INK, limb_colors
from rbprm_core.view.scene import PlanScene, make_scene

Array = NDArray[np.float64]

WIDTH = 12.0  # inches of the figure
TALLEST = 11.0  # inches of the two views together
DOTS = 120  # per inch
MARGIN = 0.7  # metres shown around the way
SILHOUETTES = 5  # states in which the robot is drawn, at most
SPACING = 0.9  # metres of way from one silhouette to the next, at least
EDGE_AHEAD = 0.02  # metres that an edge counts as nearer than it is
COARSE_LINK = 1_000  # triangles; a link with more is thinned to the centimetre
LIGHT = np.array([-0.35, 0.45, 0.82])  # towards the light: right, up, to the reader


@dataclass(frozen=True, eq=False)
class View:
    """A parallel projection.

    Attributes:
        axes: indices of the coordinates drawn to the right and up the page.
        to_reader: (3,) unit vector from the scene to the reader.
        flip: whether the upward coordinate falls up the page, so that nothing is mirrored.
    """

    axes: tuple[int, int]
    to_reader: Array
    flip: bool = False

    @property
    def labels(self) -> tuple[str, str]:
        """Labels of the two axes."""
        right, up = self.axes
        return f"{'xyz'[right]} [m]", f"{'xyz'[up]} [m]"

    @property
    def light(self) -> Array:
        """(3,) unit vector to the light in the planning frame."""
        right, up = np.eye(3)[list(self.axes)]
        up = -up if self.flip else up
        direction: Array = LIGHT[0] * right + LIGHT[1] * up + LIGHT[2] * self.to_reader
        return direction / float(np.linalg.norm(direction))


def write_picture(plan: ContactPlan, path: str | Path) -> None:
    """Write a PNG: footholds from above, the robot from the side, robustness over the states.

    Raises:
        InvalidInput: the plan cannot be shown (see `make_scene`) or the file cannot be written.
    """
    scene = make_scene(plan)
    low, high = _window(scene)
    above, side = _views(high - low)
    figure, panels = _layout((high - low)[[*above.axes, 2]])
    ground = _cropped(scene.environment, low, high)
    colors = limb_colors(scene.limbs)
    _draw_above(panels[0], scene, ground, above, colors)
    _draw_side(panels[1], scene, ground, side, colors)
    _frame(panels[0], above, low, high)
    _frame(panels[1], side, low, high)
    _draw_robustness(panels[2], plan)
    _caption(figure, plan, colors)
    try:
        figure.savefig(path, format="png")
    except OSError as error:
        raise InvalidInput("out", str(path), f"cannot be written: {error.strerror}") from error


def _views(extent: Array) -> tuple[View, View]:
    """From above and from the side; the longer side of the way runs across the page."""
    up = np.array([0, 0, 1.0])
    if extent[0] >= extent[1]:
        return View((0, 1), up), View((0, 2), np.array([0, -1.0, 0]))
    return View((1, 0), up, flip=True), View((1, 2), np.array([1.0, 0, 0]))


def _layout(extent: Array) -> tuple[Figure, list[Axes]]:
    """Three panels under each other for a scene so many metres wide, deep and tall."""
    wide, deep, tall = extent
    # inches per metre: as wide as labels leave, unless a short way would make a long page
    scale = min((WIDTH - 1.4) / wide, TALLEST / (deep + tall))
    heights = [scale * deep, scale * tall, 1.5]
    figure = Figure(figsize=(WIDTH, sum(heights) + 2.6), dpi=DOTS, layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(3, 1, gridspec_kw={"height_ratios": heights})
    return figure, list(panels)


def _window(scene: PlanScene) -> tuple[Array, Array]:
    """Lowest and highest corner of what is shown, metres: the way with a margin, the robot too."""
    bodies = scene.placements(scene.configurations)[:, :, :3, 3].reshape(-1, 3)
    marks = np.array([mark.position for mark in scene.footprints]).reshape(-1, 3)
    points = np.vstack((bodies, marks, scene.guide))
    size = min(1.0, float(np.ptp(points, axis=0).max()))  # less for what is small, as a hand is
    low: Array = points.min(axis=0) - size * np.array([MARGIN, MARGIN, 0.15])
    high: Array = points.max(axis=0) + size * np.array([MARGIN, MARGIN, 0.4])
    return low, high


def _cropped(mesh: trimesh.Trimesh, low: Array, high: Array) -> trimesh.Trimesh:
    """The triangles whose boxes reach into a window; of its height, all."""
    if mesh.is_empty:
        return mesh
    corners = mesh.triangles[:, :, :2]
    inside = (corners.max(axis=1) > low[:2]) & (corners.min(axis=1) < high[:2])
    copy = mesh.copy()
    copy.update_faces(inside.all(axis=1))
    copy.remove_unreferenced_vertices()
    return copy


def _shades(mesh: trimesh.Trimesh, view: View, color: str) -> Array:
    """(k, 3) colours of the triangles under the light of the view."""
    # a mesh may be inside out or open: light what is seen
    facing = np.where(mesh.face_normals @ view.to_reader < 0, -1.0, 1.0)
    bright = 0.5 + 0.58 * np.clip(facing * (mesh.face_normals @ view.light), 0, 1)
    shades: Array = bright[:, None] * np.array(to_rgb(color))
    return shades


def _draw_mesh(axes: Axes, mesh: trimesh.Trimesh, view: View, color: str, order: float) -> None:
    """Shaded triangles, the farthest first."""
    far_first = np.argsort(mesh.triangles_center @ view.to_reader)
    shades = np.clip(_shades(mesh, view, color), 0, 1)[far_first]
    flat = mesh.triangles[far_first][:, :, list(view.axes)]
    axes.add_collection(
        PolyCollection(flat, facecolors=shades, edgecolors=shades, linewidths=0.3, zorder=order)
    )


def _draw_ground(axes: Axes, ground: trimesh.Trimesh, view: View) -> None:
    """Triangles and sharp edges together, the farthest first, so that what is behind is hidden."""
    if ground.is_empty:
        return
    edges = sharp_edges(ground)
    depths = ground.triangles_center @ view.to_reader
    nearness = (depths - depths.min()) / max(np.ptp(depths), 1e-9)
    shades = _shades(ground, view, GROUND) * (0.9 + 0.16 * nearness)[:, None]
    outlines = np.vstack((shades.clip(0, 1), np.tile(to_rgb(GROUND_EDGE), (len(edges), 1))))
    flat = [*ground.triangles[:, :, list(view.axes)], *edges[:, :, list(view.axes)]]
    # an edge goes right after the triangles that it bounds
    depths = np.concatenate((depths, edges.mean(axis=1) @ view.to_reader + EDGE_AHEAD))
    far_first = np.argsort(depths)
    axes.add_collection(
        PolyCollection(
            [flat[i] for i in far_first],
            facecolors=outlines[far_first],
            edgecolors=outlines[far_first],
            linewidths=0.6,
            zorder=1,
        )
    )


def _draw_guide(axes: Axes, scene: PlanScene, view: View, order: float) -> None:
    if not len(scene.guide):
        return
    x, y = scene.guide[:, list(view.axes)].T
    halo = [withStroke(linewidth=3, foreground="white")]
    axes.plot(x, y, color=GUIDE, linewidth=1.5, dashes=(5, 2), path_effects=halo, zorder=order)
    axes.plot(x[:1], y[:1], "o", color=GUIDE, markersize=7, zorder=order)
    axes.plot(x[-1:], y[-1:], "*", color=GUIDE, markersize=13, zorder=order)


def _draw_above(
    axes: Axes, scene: PlanScene, ground: trimesh.Trimesh, view: View, colors: dict[str, str]
) -> None:
    """Ground, guide and the footholds of each limb joined in their order."""
    _draw_ground(axes, ground, view)
    _draw_guide(axes, scene, view, 3)
    around = [withStroke(linewidth=2.2, foreground="white")]
    for i, (limb, color) in enumerate(colors.items()):
        marks = [mark for mark in scene.footprints if mark.limb == limb]
        x, y = np.array([mark.position for mark in marks])[:, list(view.axes)].T
        axes.plot(x, y, color=color, linewidth=1.3, alpha=0.8, zorder=4)
        for mark in marks:
            if len(mark.corners):
                axes.fill(*mark.corners[:, list(view.axes)].T, color=color, alpha=0.35, zorder=4)
        axes.plot(x, y, "o", color=color, markersize=8, markeredgecolor="white", zorder=5)
        for mark, u, v in zip(marks, x, y, strict=True):
            axes.annotate(
                str(mark.state),
                (u, v),
                # limbs step into each other's prints: their numbers go to different sides
                xytext=(0, -10 if i % 2 else 10),
                textcoords="offset points",
                ha="center",
                va="center",
                fontsize=8,
                color=color,
                path_effects=around,
                zorder=6,
            )
    axes.set_title("From above: footholds, numbered by the state that makes them", loc="left")


def _draw_side(
    axes: Axes, scene: PlanScene, ground: trimesh.Trimesh, view: View, colors: dict[str, str]
) -> None:
    """Ground, the robot in a few states and all footholds."""
    _draw_ground(axes, ground, view)
    _draw_guide(axes, scene, view, 4)
    links = [
        thinned(link.mesh, digits=2) if len(link.mesh.faces) > COARSE_LINK else link.mesh
        for link in scene.links
    ]
    shown = _spread(scene.roots)
    for order, (state, frames) in enumerate(
        zip(shown, scene.placements(scene.configurations[shown]), strict=True)
    ):
        top = _draw_robot(axes, scene, links, frames, view, colors, 3 + 0.1 * order)
        across = scene.roots[state][view.axes[0]]
        axes.annotate(f"state {state}", (across, top + 0.04), ha="center", fontsize=9, color=INK)
    for mark in scene.footprints:
        u, v = mark.position[list(view.axes)]
        axes.plot(u, v, "o", color=colors[mark.limb], markersize=4, markeredgecolor="white",
                  markeredgewidth=0.6, zorder=5)  # fmt: skip
    axes.set_title("From the side: the robot in some of the states", loc="left")


def _draw_robot(
    axes: Axes,
    scene: PlanScene,
    links: list[trimesh.Trimesh],
    frames: Array,
    view: View,
    colors: dict[str, str],
    order: float,
) -> float:
    """One state, the farther links first; returns its highest z in metres."""
    depths = frames[:, :3, 3] @ view.to_reader
    ranks = np.argsort(np.argsort(depths)) / len(links)
    placed = [mesh.copy().apply_transform(frame) for mesh, frame in zip(links, frames, strict=True)]
    for link, mesh, rank in zip(scene.links, placed, ranks, strict=True):
        _draw_mesh(axes, mesh, view, colors.get(link.limb, BODY), order + 0.09 * rank)
    return max(float(mesh.bounds[1, 2]) for mesh in placed)


def _spread(roots: Array) -> list[int]:
    """States evenly along the way, first and last among them."""
    way = np.concatenate(([0], np.cumsum(np.linalg.norm(np.diff(roots, axis=0), axis=1))))
    count = int(np.clip(way[-1] // SPACING + 1, 1, SILHOUETTES))
    stops = np.linspace(0, way[-1], max(count, 2))
    return sorted({int(np.abs(way - stop).argmin()) for stop in stops})


def _frame(axes: Axes, view: View, low: Array, high: Array) -> None:
    """Limits, equal scales and labels."""
    right, up = view.axes
    axes.set_aspect("equal")
    axes.set_xlim(low[right], high[right])
    axes.set_ylim(low[up], high[up])
    if view.flip:
        axes.invert_yaxis()
    axes.set_xlabel(view.labels[0])
    axes.set_ylabel(view.labels[1])
    axes.tick_params(color=GROUND_EDGE)
    axes.spines[:].set_color(GROUND_EDGE)


def _draw_robustness(axes: Axes, plan: ContactPlan) -> None:
    """Bars of b0, those under the threshold red."""
    b0 = np.array([state.robustness for state in plan.states])
    threshold = plan.request.robustness_threshold
    colors = [BAD if value < threshold else "#9fb3c8" for value in b0]
    axes.bar(np.arange(len(b0)), b0, color=colors, width=0.7)
    axes.axhline(threshold, color=BAD, linewidth=1.2, dashes=(5, 3))
    axes.annotate(
        f"threshold {threshold:g} N",
        (1.005, threshold),
        xycoords=("axes fraction", "data"),
        color=BAD,
        va="center",
        fontsize=9,
    )
    axes.set_xlim(-0.8, len(b0) - 0.2)
    axes.set_xlabel("state")
    axes.set_ylabel("b0 [N]")
    axes.spines[["top", "right"]].set_visible(False)
    axes.set_title(f"Robustness of each state (least: {b0.min():.3g} N)", loc="left")


def _caption(figure: Figure, plan: ContactPlan, colors: dict[str, str]) -> None:
    """Title and legend."""
    where = f" on {plan.environment.name}" if plan.environment.name else ""
    figure.suptitle(
        f"{plan.robot.name}{where}: {len(plan.states)} states", fontsize=15, fontweight="bold"
    )
    handles = [
        Line2D([], [], color=color, marker="o", markeredgecolor="white", label=limb)
        for limb, color in colors.items()
    ]
    guide = Line2D([], [], color=GUIDE, dashes=(5, 2), label="guide (root), start to goal")
    figure.legend(
        handles=[*handles, guide], loc="outside lower center", ncols=len(handles) + 1, frameon=False
    )
