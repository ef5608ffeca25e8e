"""Scenarios of growing size, derived from a given scenario."""

from __future__ import annotations

import numpy as np

from rbprm_core.scenario import Scenario, SurfaceText

TILE = 0.5  # metres, side of a tile
GAP = 0.1  # metres between tiles
CLEAR = 1.0  # metres between the scenario's surfaces and the first tile
IN_A_ROW = 20  # number of tiles


def longer(scenario: Scenario, times: int) -> Scenario:
    """A scenario with a multiple of the distance from start to goal.

    The meshes are repeated along x with the distance from start to goal as period; the goal, the
    bounds and the time limit grow accordingly.

    Args:
        scenario: scenario of meshes, start and goal.
        times: number of repetitions.
    """
    request = scenario.request
    period = request.goal.position[0] - request.start.position[0]
    meshes = [
        mesh.model_copy(update={"translation": _along_x(mesh.translation, k * period)})
        for k in range(times)
        for mesh in scenario.environment.meshes
    ]
    more = (times - 1) * period
    goal = request.goal.model_copy(update={"position": _along_x(request.goal.position, more)})
    low, high = request.bounds.x
    bounds = request.bounds.model_copy(update={"x": (low, high + more)})
    changed = {"goal": goal, "bounds": bounds, "time_limit": times * request.time_limit}
    return scenario.model_copy(
        update={
            "name": f"{scenario.name}_x{times}",
            "environment": scenario.environment.model_copy(update={"meshes": tuple(meshes)}),
            "request": request.model_copy(update=changed),
            "robots": {},
        }
    )


def surrounded(scenario: Scenario, count: int) -> Scenario:
    """A scenario with additional tiles of ground on both sides of its surfaces, out of reach.

    The tiles lie in rows along x, alternately on either side, each row farther out than the last.

    Args:
        scenario: scenario of surfaces, start and goal.
        count: number of tiles.
    """
    corners = [corner for surface in scenario.environment.surfaces for corner in surface.vertices]
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
    surfaces = (*scenario.environment.surfaces, *tiles)
    return scenario.model_copy(
        update={
            "name": f"{scenario.name}_{count}_tiles",
            "environment": scenario.environment.model_copy(update={"surfaces": surfaces}),
        }
    )


def _along_x(place: tuple[float, float, float], by: float) -> tuple[float, float, float]:
    x, y, z = place
    return x + by, y, z
