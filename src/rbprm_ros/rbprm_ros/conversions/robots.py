"""The known robots as messages."""

from __future__ import annotations

from functools import lru_cache

from rbprm_msgs.msg import RobotInfo

from rbprm_core.robot import Robot, known_robots, load_description


def robot_messages(*files: str) -> list[RobotInfo]:
    """Messages of all known robots, sorted by name, then of robots from files.

    The first call loads the robots' models, which takes a tenth of a second.

    Args:
        files: paths of robot files, as in requests; known names are not listed again.

    Raises:
        InvalidInput: a robot file cannot be used.
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
