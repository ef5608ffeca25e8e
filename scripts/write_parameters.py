"""Write the commented parameter file of each robot: src/rbprm_ros/config/ROBOT.yaml.

Run in the workspace (scripts/in_workspace.sh) after an option was added or its text changed; a test
compares the files with what this gives.
"""

from __future__ import annotations

import sys
import textwrap
from pathlib import Path

from rbprm_ros.node.parameters import MAX_FLOAT, MAX_INTEGER, Option, parameter_options

FOLDER = Path(__file__).resolve().parents[1] / "src" / "rbprm_ros" / "config"
WIDTH = 96

# Least b0, newtons: a fiftieth of the weight or less, as the scenarios of each robot ask for.
ROBOTS = {"hyq": 10.0, "anymal": 3.5, "go2": 2.0, "talos": 2.0, "g1": 2.0, "allegro": 0.0}

# Lengths of a hand, not of a walking robot, as the scenario `pen` has them.
OTHERS = {
    "allegro": {
        "classification.min_area": 0.0,
        "guide.resolution": 0.01,
        "guide.rrt.step": 0.05,
        "generator.band": 0.01,
        "generator.edge_margin": 0.0005,
        "generator.spacing": 0.006,
        "generator.move": 0.005,
        "generator.candidates": 100,
        "sequence.step": 0.02,
        "sequence.min_step": 0.0025,
        "sequence.look_ahead": 0.05,
    }
}


def text_of(robot: str) -> str:
    """The file of a robot."""
    others = OTHERS.get(robot, {})
    own = {"robot": robot, "robustness_threshold": ROBOTS[robot], **others}
    lengths = ", and for lengths of a hand," if others else ""
    lines = [
        f"# Parameters of the planner's node for {robot}. All are optional; but for `robot` and",
        f"# `robustness_threshold`{lengths} they stand here as they are without this file.",
        "#",
        f"#     ros2 run rbprm_ros planner_node --ros-args --params-file {robot}.yaml",
        "",
        "/**:  # whatever namespace and name the node has",
        "  ros__parameters:",
    ]
    for option in parameter_options():
        lines += entry(option, own.get(option.name, option.default))
    return "\n".join(lines) + "\n"


def entry(option: Option, value: object) -> list[str]:
    """The lines of one parameter."""
    text = option.descriptor.description
    note = f"{text[0].upper()}{text[1:]} {bounds(option)}".strip()
    lines = textwrap.wrap(note, WIDTH - 6, initial_indent="    # ", subsequent_indent="    # ")
    return ["", *lines, f"    {option.name}: {written(value)}"]


def bounds(option: Option) -> str:
    """The range, where there is one."""
    if option.descriptor.read_only:
        return "Only at the start."
    for ranges in (option.descriptor.floating_point_range, option.descriptor.integer_range):
        for span in ranges:
            if span.to_value in (MAX_FLOAT, MAX_INTEGER):
                return f"At least {span.from_value:g}."
            return f"From {span.from_value:g} to {span.to_value:g}."
    return ""


def written(value: object) -> str:
    """A value in YAML."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return f"{value:#.12g}".rstrip("0") + ("0" if value == int(value) else "")
    return str(value)


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    for name in ROBOTS:
        (FOLDER / f"{name}.yaml").write_text(text_of(name))
        print(FOLDER / f"{name}.yaml", file=sys.stderr)
