"""Write the commented parameter file of each robot: src/rbprm_ros/config/ROBOT.yaml.

Run it in the workspace (scripts/in_workspace.sh) after an option was added or its description has
changed; a test compares the files with the output of this script.
"""

from __future__ import annotations

import sys
import textwrap
from pathlib import Path

from rbprm_ros.node.parameters import MAX_FLOAT, MAX_INTEGER, Option, parameter_options

FOLDER = Path(__file__).resolve().parents[1] / "src" / "rbprm_ros" / "config"
WIDTH = 96

# Minimum b0, newtons: a fiftieth of the weight or less, as in the scenarios of each robot.
ROBOTS = {"hyq": 10.0, "anymal": 3.5, "go2": 2.0, "talos": 2.0, "g1": 2.0, "allegro": 0.0}

# Options of a hand, whose lengths are smaller, as in the scenario `pen`.
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
    """The parameter file of a robot."""
    others = OTHERS.get(robot, {})
    own = {"robot": robot, "robustness_threshold": ROBOTS[robot], **others}
    hand = ", and options of a hand," if others else ""
    lines = [
        f"# Parameters of the planner's node for {robot}. All are optional. Except for `robot` and",
        f"# `robustness_threshold`{hand} the values are the defaults.",
        "#",
        f"#     ros2 run rbprm_ros planner_node --ros-args --params-file {robot}.yaml",
        "",
        "/**:  # any namespace and name of the node",
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
    """The range in words; "" where there is none."""
    if option.descriptor.read_only:
        return "Read-only."
    for ranges in (option.descriptor.floating_point_range, option.descriptor.integer_range):
        for span in ranges:
            if span.to_value in (MAX_FLOAT, MAX_INTEGER):
                return f"At least {span.from_value:g}."
            return f"From {span.from_value:g} to {span.to_value:g}."
    return ""


def written(value: object) -> str:
    """A value as YAML."""
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
