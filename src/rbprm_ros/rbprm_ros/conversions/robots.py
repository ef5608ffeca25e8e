"""The robots that can be planned for."""

from __future__ import annotations

from functools import lru_cache

from rbprm_msgs.msg import RobotInfo

from rbprm_core.robot import Robot, known_robots, load_description


def robot_messages(*files: str) -> list[RobotInfo]:
    """All known robots by name, then robots of files.

    The first call reads the robots' models, a tenth of a second; those that follow do not.

    Args:
        files: paths of robot files, as requests name them; a known name is not told twice.

    Raises:
        InvalidInput: a robot file that cannot be used.
    """
    return [_message(name) for name in dict.fromkeys([*sorted(known_robots()), *files])]


def _message(name: str) -> RobotInfo:
    description = load_description(name)
    chosen = description.using()
    return RobotInfo(
        name=name,
        urdf=description.urdf,
        limbs=[limb.name for limb in description.limbs],
        default_limbs=[limb.name for limb in chosen.limbs],
        reference_height=_height(name),
    )


@lru_cache(maxsize=64)
def _height(name: str) -> float:
    return Robot.load(load_description(name)).reference_height
