"""What is computed once for a robot and kept on disk: volumes, samples, which pairs need meshes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import coal
import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from rbprm_core.cache import Arrays, cached, key_of
from rbprm_core.resources import find_resource
from rbprm_core.robot.bodies import Bodies, find_exact_pairs, make_bodies
from rbprm_core.robot.database import LimbDatabase
from rbprm_core.robot.model import Robot
from rbprm_core.robot.sampling import sample_limb
from rbprm_core.robot.volumes import TrunkPiece, reachable_workspace, trunk_volume

Array = NDArray[np.float64]

FORMAT = "6"  # raise when what is kept, or how it is made, changes
PARTS = ("joints", "positions", "rotations", "jacobians", "coms")  # of LimbSamples and LimbDatabase


@dataclass(frozen=True, eq=False)
class RobotData:
    """A robot with all that depends on it alone.

    Attributes:
        bodies: collision bodies. trunk: the pieces of W0.
        workspaces: per limb, the corners (v, 3) of Wk in the limb's base frame, metres.
        faces: per limb, the faces (f, 4) of Wk: a point x is inside where n . x + d <= 0.
        databases: per limb, the sample database of section 4.1.
        height: of the root over its lowest contact in the reference posture, metres.
    """

    robot: Robot
    bodies: Bodies
    trunk: tuple[TrunkPiece, ...]
    workspaces: tuple[Array, ...]
    faces: tuple[Array, ...]
    databases: tuple[LimbDatabase, ...]
    height: float


def load_robot_data(
    robot: Robot, report: Callable[[float], None] = lambda fraction: None
) -> RobotData:
    """The data of a robot, from the cache or computed.

    Args:
        report: told the share done, 0 to 1; may raise to stop.
    """
    arrays = cached(f"robot-{robot.name}", _key(robot), lambda: _compute(robot, report))
    report(1.0)
    limbs = range(len(robot.limbs))
    workspaces = tuple(arrays[f"workspace_{k}"].astype(float) for k in limbs)
    databases = []
    for k in limbs:
        databases.append(LimbDatabase(*(arrays[f"{part}_{k}"].astype(float) for part in PARTS)))
        report(1.0)
    bodies = make_bodies(robot, arrays["exact_pairs"].astype(bool))
    report(1.0)
    return RobotData(
        robot=robot,
        bodies=bodies,
        trunk=tuple(trunk_volume(robot, robot.description.volumes.trunk_scale)),
        workspaces=workspaces,
        faces=tuple(ConvexHull(corners).equations for corners in workspaces),
        databases=tuple(databases),
        height=robot.reference_height,
    )


def _compute(robot: Robot, report: Callable[[float], None]) -> Arrays:
    rng = np.random.default_rng(robot.description.seed)
    volumes = robot.description.volumes
    exact = find_exact_pairs(robot, rng, lambda: report(0.0))
    bodies = make_bodies(robot, exact)
    arrays: Arrays = {"exact_pairs": exact}
    count = len(robot.limbs)
    for k, limb in enumerate(robot.limbs):

        def share(part: float, k: int = k) -> None:
            report((k + part) / count)

        found = sample_limb(robot, bodies, limb, volumes.samples, rng, share)
        report((k + 1) / count)
        arrays[f"workspace_{k}"] = reachable_workspace(found.positions, volumes.faces)
        for part in PARTS:
            arrays[f"{part}_{k}"] = getattr(found, part)[: limb.samples]
    return arrays


def _key(robot: Robot) -> str:
    return key_of(_inputs(robot))


def _inputs(robot: Robot) -> Iterator[bytes]:
    """Everything that the data depends on: formats, libraries, description, robot files."""
    yield FORMAT.encode()
    yield f"{pin.__version__} {coal.__version__} {np.__version__}".encode()
    # No kept data depend on how candidates are ranked, nor on the trunk, which is quickly made.
    text = robot.description.model_dump_json(
        exclude={
            "limbs": {"__all__": {"heuristics"}},
            "volumes": {"trunk_links": True, "trunk_scale": True},
        }
    )
    yield text.encode()
    yield find_resource(robot.description.urdf, "robot.urdf").read_bytes()
    if robot.description.srdf is not None:
        yield find_resource(robot.description.srdf, "robot.srdf").read_bytes()
    for body in robot.geometry.geometryObjects:
        path = Path(body.meshPath)
        if path.is_file():
            yield path.read_bytes()
