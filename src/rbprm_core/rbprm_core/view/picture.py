"""A picture of a plan: from above, from the side, and the robustness of its states."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import trimesh
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke

from rbprm_core.arrays import Array
from rbprm_core.errors import InvalidInput
from rbprm_core.plan_record import ContactPlan
from rbprm_core.view.mesh_operations import thinned
from rbprm_core.view.palette import BAD, BODY, GROUND_EDGE, GUIDE, INK, limb_colors
from rbprm_core.view.picture_views import View, above_and_side, draw_environment, draw_mesh
from rbprm_core.view.plan_geometry import PlanGeometry, load_plan_geometry

WIDTH = 12.0  # inches of the figure
MAX_VIEWS_HEIGHT = 11.0  # inches of the two views together
DOTS_PER_INCH = 120
MARGIN = 0.7  # metres shown around the path
SILHOUETTES = 5  # states in which the robot is drawn, at most
MIN_SPACING = 0.9  # metres of path from one silhouette to the next
COARSE_LINK = 1_000  # triangles; meshes of links with more are thinned to the centimetre


def write_picture(plan: ContactPlan, path: str | Path) -> None:
    """Write a PNG: footholds from above, the robot from the side, robustness over the states.

    Args:
        plan: plan to show.
        path: path of the PNG file.

    Raises:
        InvalidInput: the plan cannot be shown (see `load_plan_geometry`), or the file cannot be
            written.
    """
    geometry = load_plan_geometry(plan)
    low, high = _window(geometry)
    above, side = above_and_side(high - low)
    figure, panels = _layout((high - low)[[*above.axes, 2]])
    ground = _cropped(geometry.environment, low, high)
    colors = limb_colors(geometry.limbs)
    _draw_above(panels[0], geometry, ground, above, colors)
    _draw_side(panels[1], geometry, ground, side, colors)
    _frame(panels[0], above, low, high)
    _frame(panels[1], side, low, high)
    _draw_robustness(panels[2], plan)
    _caption(figure, plan, colors)
    try:
        figure.savefig(path, format="png")
    except OSError as error:
        raise InvalidInput("out", str(path), f"cannot be written: {error.strerror}") from error


def _layout(extent: Array) -> tuple[Figure, list[Axes]]:
    """Return a figure with three panels below each other.

    Args:
        extent: (3,) width, depth and height of what is shown, metres.
    """
    wide, deep, tall = extent
    # inches per metre: the full width, unless a short path would make a long page
    scale = min((WIDTH - 1.4) / wide, MAX_VIEWS_HEIGHT / (deep + tall))
    heights = [scale * deep, scale * tall, 1.5]
    figure = Figure(figsize=(WIDTH, sum(heights) + 2.6), dpi=DOTS_PER_INCH, layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(3, 1, gridspec_kw={"height_ratios": heights})
    return figure, list(panels)


def _window(geometry: PlanGeometry) -> tuple[Array, Array]:
    """Return the lowest and highest corner of what is shown, metres: path, robot and a margin."""
    bodies = geometry.placements(geometry.configurations)[:, :, :3, 3].reshape(-1, 3)
    marks = np.array([mark.position for mark in geometry.footprints]).reshape(-1, 3)
    points = np.vstack((bodies, marks, geometry.guide))
    size = min(1.0, float(np.ptp(points, axis=0).max()))  # less for small robots, such as a hand
    low: Array = points.min(axis=0) - size * np.array([MARGIN, MARGIN, 0.15])
    high: Array = points.max(axis=0) + size * np.array([MARGIN, MARGIN, 0.4])
    return low, high


def _cropped(mesh: trimesh.Trimesh, low: Array, high: Array) -> trimesh.Trimesh:
    """Return the triangles whose bounding boxes meet a window, whatever their height."""
    if mesh.is_empty:
        return mesh
    corners = mesh.triangles[:, :, :2]
    inside = (corners.max(axis=1) > low[:2]) & (corners.min(axis=1) < high[:2])
    copy = mesh.copy()
    copy.update_faces(inside.all(axis=1))
    copy.remove_unreferenced_vertices()
    return copy


def _draw_guide(axes: Axes, geometry: PlanGeometry, view: View, order: float) -> None:
    """Draw the guide path with its start and goal."""
    if not len(geometry.guide):
        return
    x, y = geometry.guide[:, list(view.axes)].T
    halo = [withStroke(linewidth=3, foreground="white")]
    axes.plot(x, y, color=GUIDE, linewidth=1.5, dashes=(5, 2), path_effects=halo, zorder=order)
    axes.plot(x[:1], y[:1], "o", color=GUIDE, markersize=7, zorder=order)
    axes.plot(x[-1:], y[-1:], "*", color=GUIDE, markersize=13, zorder=order)


def _draw_above(
    axes: Axes, geometry: PlanGeometry, ground: trimesh.Trimesh, view: View, colors: dict[str, str]
) -> None:
    """Draw environment, guide and the footholds of each limb, joined in their order."""
    draw_environment(axes, ground, view)
    _draw_guide(axes, geometry, view, 3)
    around = [withStroke(linewidth=2.2, foreground="white")]
    for i, (limb, color) in enumerate(colors.items()):
        marks = [mark for mark in geometry.footprints if mark.limb == limb]
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
                # footholds of two limbs may coincide: their numbers go to different sides
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
    axes: Axes, geometry: PlanGeometry, ground: trimesh.Trimesh, view: View, colors: dict[str, str]
) -> None:
    """Draw environment, guide, the robot in a few states and all footholds."""
    draw_environment(axes, ground, view)
    _draw_guide(axes, geometry, view, 4)
    links = [
        thinned(link.mesh, digits=2) if len(link.mesh.faces) > COARSE_LINK else link.mesh
        for link in geometry.links
    ]
    shown = _spread(geometry.roots)
    for order, (state, frames) in enumerate(
        zip(shown, geometry.placements(geometry.configurations[shown]), strict=True)
    ):
        top = _draw_robot(axes, geometry, links, frames, view, colors, 3 + 0.1 * order)
        across = geometry.roots[state][view.axes[0]]
        axes.annotate(f"state {state}", (across, top + 0.04), ha="center", fontsize=9, color=INK)
    for mark in geometry.footprints:
        u, v = mark.position[list(view.axes)]
        axes.plot(u, v, "o", color=colors[mark.limb], markersize=4, markeredgecolor="white",
                  markeredgewidth=0.6, zorder=5)  # fmt: skip
    axes.set_title("From the side: the robot in some of the states", loc="left")


def _draw_robot(
    axes: Axes,
    geometry: PlanGeometry,
    links: list[trimesh.Trimesh],
    frames: Array,
    view: View,
    colors: dict[str, str],
    order: float,
) -> float:
    """Draw the robot in one state, the farther links first; return its greatest z, metres."""
    depths = frames[:, :3, 3] @ view.to_reader
    ranks = np.argsort(np.argsort(depths)) / len(links)
    placed = [mesh.copy().apply_transform(frame) for mesh, frame in zip(links, frames, strict=True)]
    for link, mesh, rank in zip(geometry.links, placed, ranks, strict=True):
        draw_mesh(axes, mesh, view, colors.get(link.limb, BODY), order + 0.09 * rank)
    return max(float(mesh.bounds[1, 2]) for mesh in placed)


def _spread(roots: Array) -> list[int]:
    """Return indices of states spread evenly along the path, the first and the last included."""
    path = np.concatenate(([0], np.cumsum(np.linalg.norm(np.diff(roots, axis=0), axis=1))))
    count = int(np.clip(path[-1] // MIN_SPACING + 1, 1, SILHOUETTES))
    stops = np.linspace(0, path[-1], max(count, 2))
    return sorted({int(np.abs(path - stop).argmin()) for stop in stops})


def _frame(axes: Axes, view: View, low: Array, high: Array) -> None:
    """Set limits, equal scales and labels."""
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
    """Draw a bar of b0 for each state, in red below the threshold."""
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
    axes.set_title(f"Robustness of each state (minimum: {b0.min():.3g} N)", loc="left")


def _caption(figure: Figure, plan: ContactPlan, colors: dict[str, str]) -> None:
    """Add title and legend."""
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
