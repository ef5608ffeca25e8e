"""Posture generators: a whole-body configuration that satisfies contacts, statics and limits.

A single problem:

    setting = posture_setting(load_robot_data(robot), scene)
    problem, start = witness_problem(Transition.between(before, after), WitnessEnd.LIFT_OFF, 5.0)
    found = generate_posture(setting, problem, start)
"""

from rbprm_core.posture.generate import generate_posture, posture_setting
from rbprm_core.posture.problem import PostureProblem
from rbprm_core.posture.protocol import PostureOptions, PostureSetting
from rbprm_core.posture.witness import WitnessEnd, witness_problem

__all__ = [
    "PostureOptions",
    "PostureProblem",
    "PostureSetting",
    "WitnessEnd",
    "generate_posture",
    "posture_setting",
    "witness_problem",
]
