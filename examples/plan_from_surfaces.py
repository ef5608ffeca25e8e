"""Plan on polygons, such as those of perception: HyQ crosses a gap on three stepping stones.

Run it by `.venv/bin/python examples/plan_from_surfaces.py`.
"""

from __future__ import annotations

import numpy as np

from rbprm_core.budget import Budget
from rbprm_core.guide.root import RootBounds
from rbprm_core.placement import Placement
from rbprm_core.planner import plan
from rbprm_core.request import PlanRequest
from rbprm_core.robot import Robot, load_description
from rbprm_core.robot.data import load_robot_data
from rbprm_core.scene import Scene, Surface, make_surface


def slab(name: str, x: tuple[float, float], height: float) -> Surface:
    """A horizontal rectangle, 1.6 m wide.

    Args:
        name: id of the surface.
        x: smallest and largest x, metres.
        height: z, metres.
    """
    low, high = x
    # Counter-clockwise seen from above, so that the normal points upwards.
    corners = [[low, -0.8], [high, -0.8], [high, 0.8], [low, 0.8]]
    return make_surface(name, [[*corner, height] for corner in corners], friction=0.6)


def main() -> None:
    """Plan, and print the surfaces that the feet are on in each state."""
    robot = Robot.load(load_description("hyq"))
    scene = Scene(
        [
            slab("near_bank", (-2.0, 0.0), 0.0),
            *(slab(f"stone_{i}", (0.2 + 0.4 * i, 0.4 + 0.4 * i), 0.05 * i) for i in range(3)),
            slab("far_bank", (1.4, 3.5), 0.0),
        ]
    )
    limbs = tuple(limb.name for limb in robot.limbs)
    request = PlanRequest(
        start=Placement.parse([-1.0, 0.0, 0.6]),
        goal=Placement.parse([2.4, 0.0, 0.6]),
        bounds=RootBounds(
            low=np.array([-2.0, -0.5, 0.4]),
            high=np.array([3.5, 0.5, 1.0]),
            half_ranges=np.array([0.4, 0.2, 0.2]),
        ),
        required_limbs=limbs,
        start_limbs=limbs,
        robustness_threshold=10.0,
    )
    outcome = plan(request, load_robot_data(robot), scene, Budget(time_limit=30.0))
    for index, state in enumerate(outcome.states):
        feet = ", ".join(f"{limbs[c.limb]} on {c.surface}" for c in state.contacts)
        print(f"{index:3d}  x {state.q[0]:5.2f} m  b0 {state.robustness:5.1f} N  {feet}")
    print(f"{outcome.statistics.time['total']:.2f} s")


if __name__ == "__main__":
    main()
