"""Scenarios of growing size, made from one that is given."""

from __future__ import annotations

import numpy as np

from rbprm_core.scenario import Scenario, SurfaceText

TILE = 0.5  # metres, side of a tile
GAP = 0.1  # metres between tiles
CLEAR = 1.0  # metres between the robot's surroundings and the first tile
IN_A_ROW = 20


def longer(text: Scenario, times: int) -> Scenario:
    """A scenario whose way is that many times as long.

    Its meshes are repeated from start to goal along x, which is how far the goal moves as well.
    """
    request = text.request
    period = request.goal.position[0] - request.start.position[0]
    meshes = [
        mesh.model_copy(update={"translation": _along_x(mesh.translation, k * period)})
        for k in range(times)
        for mesh in text.environment.meshes
    ]
    more = (times - 1) * period
    goal = request.goal.model_copy(update={"position": _along_x(request.goal.position, more)})
    low, high = request.bounds.x
    bounds = request.bounds.model_copy(update={"x": (low, high + more)})
    changed = {"goal": goal, "bounds": bounds, "time_limit": times * request.time_limit}
    return text.model_copy(
        update={
            "name": f"{text.name}_x{times}",
            "environment": text.environment.model_copy(update={"meshes": tuple(meshes)}),
            "request": request.model_copy(update=changed),
            "robots": {},
        }
    )


def surrounded(text: Scenario, count: int) -> Scenario:
    """A scenario with that many tiles of ground to both sides of the way, out of all reach.

    The way itself stays as it is; rows of tiles lie farther and farther out.
    """
    corners = [corner for surface in text.environment.surfaces for corner in surface.vertices]
    low, high = np.min(corners, axis=0), np.max(corners, axis=0)
    pitch = TILE + GAP
    tiles = []
    for k in range(count):
        row, column = divmod(k, IN_A_ROW)
        out = CLEAR + pitch * (row // 2)
        y = high[1] + out if row % 2 == 0 else low[1] - out - TILE
        x = low[0] + pitch * column
        square = ((x, y), (x + TILE, y), (x + TILE, y + TILE), (x, y + TILE))
        tiles.append(SurfaceText(id=f"tile_{k}", vertices=tuple((*xy, 0.0) for xy in square)))
    surfaces = (*text.environment.surfaces, *tiles)
    return text.model_copy(
        update={
            "name": f"{text.name}_{count}_tiles",
            "environment": text.environment.model_copy(update={"surfaces": surfaces}),
        }
    )


def _along_x(place: tuple[float, float, float], by: float) -> tuple[float, float, float]:
    x, y, z = place
    return x + by, y, z
