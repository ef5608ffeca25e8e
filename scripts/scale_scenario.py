"""Print a scenario's surfaces as polygons of another size, for a robot of another size.

    python scripts/scale_scenario.py rubble 0.5 > environment.toml

The environment of a plan consists of mesh files and polygons, and a mesh has no scale there.
Polygons contain everything that is needed to use or to check the plan.
"""

from __future__ import annotations

import sys

import numpy as np

from rbprm_core.arrays import Array
from rbprm_core.environment import load_scene
from rbprm_core.scenario import load_scenario
from rbprm_core.scene import Surface

DIGITS = 5  # decimal places of coordinates: hundredths of a millimetre


def main(name: str, scale: float) -> None:
    """Print the scaled surfaces of a scenario as TOML.

    Args:
        name: known name or file of the scenario.
        scale: factor on all lengths.
    """
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
    """The TOML text of one scaled polygon.

    Args:
        identity: id of the surface.
        surface: the surface.
        scale: factor on all lengths.
    """
    lines = ["[[environment.surfaces]]", f'id = "{identity}"']
    lines.append(f"vertices = {ring(surface.polygon.boundary * scale)}")
    if surface.polygon.holes:
        holes = ", ".join(ring(hole * scale) for hole in surface.polygon.holes)
        lines.append(f"holes = [{holes}]")
    lines.append(f"friction = {surface.friction:g}")
    return "\n".join(lines)


def ring(points: Array) -> str:
    """The TOML text of some points (n, 3), metres."""
    corners = (", ".join(f"{value:g}" for value in point) for point in np.round(points, DIGITS) + 0)
    return "[" + ", ".join(f"[{corner}]" for corner in corners) + "]"


if __name__ == "__main__":
    main(sys.argv[1], float(sys.argv[2]))
