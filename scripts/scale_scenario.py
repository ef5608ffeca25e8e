"""Write a scenario's meshes as polygons of another size, for a robot of another size.

    python scripts/scale_scenario.py rubble 0.5 > environment.toml

A plan names its environment by mesh files and polygons, and a mesh has no scale there; polygons
say all that is needed to use or check the plan, wherever it is read.
"""

from __future__ import annotations

import sys

import numpy as np
from numpy.typing import NDArray

from rbprm_core.environment import load_scene
from rbprm_core.scenario import load_scenario
from rbprm_core.scene import Surface

DIGITS = 5  # of the coordinates: hundredths of a millimetre


def main(name: str, scale: float) -> None:
    """Print the scaled surfaces of a scenario as TOML."""
    scenario = load_scenario(name)
    rule = scenario.environment.classification
    rule = rule.__class__(rule.support, rule.lean, rule.min_area * scale**2)
    print("[environment]")
    print(
        f"classification = {{ support = {rule.support:g}, lean = {rule.lean:g}, "
        f"min_area = {rule.min_area:g} }}"
    )
    scene = load_scene(scenario.environment_entry(), scenario.environment.classification)
    for k, surface in enumerate(scene.surfaces):
        print()
        print(entry(f"{surface.kind}_{k}", surface, scale))


def entry(identity: str, surface: Surface, scale: float) -> str:
    """One polygon of the scenario file."""
    lines = ["[[environment.surfaces]]", f'id = "{identity}"']
    lines.append(f"vertices = {ring(surface.polygon.boundary * scale)}")
    if surface.polygon.holes:
        holes = ", ".join(ring(hole * scale) for hole in surface.polygon.holes)
        lines.append(f"holes = [{holes}]")
    lines.append(f"friction = {surface.friction:g}")
    return "\n".join(lines)


def ring(points: NDArray[np.float64]) -> str:
    """Corners (n, 3) as nested arrays."""
    corners = (", ".join(f"{value:g}" for value in point) for point in np.round(points, DIGITS) + 0)
    return "[" + ", ".join(f"[{corner}]" for corner in corners) + "]"


if __name__ == "__main__":
    main(sys.argv[1], float(sys.argv[2]))
