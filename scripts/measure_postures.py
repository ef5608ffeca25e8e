"""Measure the witness postures of planned scenarios: number found, and CPU time.

.venv/bin/python scripts/measure_postures.py rubble stairs10 car
.venv/bin/python scripts/measure_postures.py rubble --max-torque-ratio 1
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from rbprm_core.body import State, Transition
from rbprm_core.budget import Budget
from rbprm_core.failure_text import failure_text
from rbprm_core.failures import Failure
from rbprm_core.planner import plan
from rbprm_core.posture import posture_setting, witness_problem
from rbprm_core.posture.generator import SqpPostureGenerator
from rbprm_core.posture.witness import ENDS
from rbprm_core.robot.data import load_robot_data
from rbprm_core.scenario import load_scenario

TIME_LIMIT = 60.0  # seconds of planning
REPEATS = 3  # the shortest time counts: the machine may be shared


def main() -> None:
    """Print a line for each scenario, and one for each witness that is not found."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenarios", nargs="+")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--min-robustness", type=float, default=5.0)
    parser.add_argument("--max-torque-ratio", type=float)
    arguments = parser.parse_args()
    for name in arguments.scenarios:
        scenario = load_scenario(name)
        data, scene = load_robot_data(scenario.load_robot()), scenario.scene()
        request = scenario.request_for(data.robot, arguments.seed)
        states = plan(request, data, scene, Budget(TIME_LIMIT)).states
        generator = SqpPostureGenerator(posture_setting(data, scene, request.gravity))
        found: list[float] = []
        failed: list[float] = []
        for text, transition in _transitions(states):
            for end in ENDS[transition.action]:
                problem = witness_problem(
                    transition, end, arguments.min_robustness, arguments.max_torque_ratio
                )
                times = []
                for _ in range(REPEATS):
                    clock = time.process_time()
                    result = generator.solve(*problem)
                    times.append(1e3 * (time.process_time() - clock))
                if isinstance(result, Failure):
                    failed.append(min(times))
                    print(f"  {name} {text} {end}: {failure_text(result)}")
                else:
                    found.append(min(times))
        total = len(found) + len(failed)
        print(
            f"{name}: {len(found)} of {total}, CPU ms {_times(found)}; not found {_times(failed)}"
        )


def _transitions(states: tuple[State, ...]) -> Iterator[tuple[str, Transition]]:
    for k, (before, after) in enumerate(pairwise(states)):
        yield f"transition {k}", Transition.between(before, after)


def _times(times: list[float]) -> str:
    if not times:
        return "none"
    median, high = np.percentile(times, [50, 95])
    return f"median {median:.2f}, 95 % {high:.2f}"


if __name__ == "__main__":
    main()
