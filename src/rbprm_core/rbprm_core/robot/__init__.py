"""The robot: its description, kinematic model, limbs, contact spots and volumes."""

from rbprm_core.robot.description import RobotDescription, known_robots, load_description
from rbprm_core.robot.limb import Limb
from rbprm_core.robot.model import Robot

__all__ = ["Limb", "Robot", "RobotDescription", "known_robots", "load_description"]
