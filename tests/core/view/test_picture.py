"""The picture: a PNG that is not empty, for paths in any direction."""

from __future__ import annotations

from pathlib import Path

import matplotlib.image
import numpy as np
import pytest

from rbprm_core.errors import InvalidInput
from rbprm_core.plan_record import ContactPlan, Pose, SurfaceEntry
from rbprm_core.view.picture import write_picture


def colors_in(path: Path) -> int:
    """Number of different colours in a PNG."""
    pixels = (matplotlib.image.imread(path)[..., :3] * 255).astype(int)
    return len(np.unique(pixels @ [1, 256, 65536]))


def test_it_shows_something(plan: ContactPlan, tmp_path: Path) -> None:
    path = tmp_path / "plan.png"
    write_picture(plan, path)
    height, width = matplotlib.image.imread(path).shape[:2]
    assert width == 1440
    assert 600 < height < 3000
    assert colors_in(path) > 500


def turned(plan: ContactPlan) -> ContactPlan:
    """The plan along y instead of x, on a level floor, with patches instead of points."""
    half = 0.5**0.5

    def turn(p: tuple[float, ...]) -> tuple[float, float, float]:
        return (-p[1], p[0], p[2])

    def patch(p: tuple[float, float, float]) -> tuple[tuple[float, float, float], ...]:
        corners = ((-0.05, -0.1), (0.05, 0.1), (0.05, -0.1), (-0.05, 0.1))
        return tuple((p[0] + x, p[1] + y, p[2]) for x, y in corners)

    states = []
    for state in plan.states:
        root = Pose(position=turn(state.root.position), orientation=(0, 0, half, half))
        contacts = tuple(
            c.model_copy(
                update={
                    "type": "planar",
                    "position": turn(c.position),
                    "normal": turn(c.normal),
                    "points": patch(turn(c.position)),
                }
            )
            for c in state.contacts
        )
        states.append(state.model_copy(update={"root": root, "contacts": contacts}))
    floor = SurfaceEntry(id="floor", vertices=((-2, -3, 0), (2, -3, 0), (2, 3, 0), (-2, 3, 0)))
    environment = plan.environment.model_copy(update={"meshes": (), "surfaces": (floor,)})
    guide = tuple(state.root for state in states)
    return plan.model_copy(
        update={"states": tuple(states), "environment": environment, "guide": guide}
    )


def test_way_along_y_with_patches(plan: ContactPlan, tmp_path: Path) -> None:
    path = tmp_path / "plan.png"
    write_picture(turned(plan), path)
    assert colors_in(path) > 500


def test_one_state_and_nothing_else(plan: ContactPlan, tmp_path: Path) -> None:
    """A partial plan may consist of its start."""
    environment = plan.environment.model_copy(update={"meshes": ()})
    alone = plan.model_copy(
        update={"states": plan.states[:1], "guide": (), "environment": environment}
    )
    write_picture(alone, tmp_path / "plan.png")
    assert colors_in(tmp_path / "plan.png") > 100


def test_bad_plan(bad_plan: ContactPlan, tmp_path: Path) -> None:
    with pytest.raises(InvalidInput):
        write_picture(bad_plan, tmp_path / "plan.png")


def test_no_such_folder(plan: ContactPlan, tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="cannot be written"):
        write_picture(plan, tmp_path / "none" / "plan.png")
