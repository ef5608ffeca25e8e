"""Data computed once for a robot and cached on disk: volumes, limb samples, exact pairs."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import coal
import numpy as np
import pinocchio as pin
from scipy.spatial import ConvexHull

from rbprm_core.arrays import Array
from rbprm_core.cache import Arrays, cached, key_of
from rbprm_core.resources import find_resource
from rbprm_core.robot.bodies import Bodies, find_exact_pairs, make_bodies
from rbprm_core.robot.database import LimbDatabase
from rbprm_core.robot.model import Robot
from rbprm_core.robot.sampling import sample_limb
from rbprm_core.robot.volumes import TrunkPiece, reachable_workspace, trunk_volume

FORMAT = "6"  # to be raised when the cached data, or the way they are computed, change
PARTS = ("joints", "positions", "rotations", "jacobians", "coms")
"""Arrays of `LimbSamples`, in the order in which `LimbDatabase` takes them."""


@dataclass(frozen=True, eq=False)
class RobotData:
    r"""A robot with all data that depend on the robot alone.

    The volumes $W^0$ and $W^k$ are those of Tonneau et al. 2018, appendix A.

    Attributes:
        robot: the robot.
        bodies: collision bodies.
        trunk: convex pieces of the trunk volume $W^0$.
        workspaces: for each limb, the corners (v, 3) of its reachable workspace $W^k$ in the limb's
            base frame, metres.
        faces: for each limb, the faces (f, 4) of $W^k$, rows $(n, d)$ with unit normals $n$ and
            offsets $d$ in metres: a point $x$ is inside where $n \cdot x + d \le 0$ for all rows.
        databases: for each limb, its sample database (Tonneau et al. 2018, section 4.1).
        height: height of the root over its lowest contact in the reference posture, metres.
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
    """The data of a robot, read from the cache or computed and cached.

    Args:
        robot: the robot.
        report: function called with the share done, 0 to 1; may raise to stop.

    Raises:
        InvalidInput: geometry that cannot be read, a limb without enough valid configurations, or
            an unknown trunk link.
    """
    key = key_of(_inputs(robot))
    arrays = cached(f"robot-{robot.name}", key, lambda: _compute(robot, report))
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
    """The arrays to be cached, by name; those of limb k end in `_k`."""
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


def _inputs(robot: Robot) -> Iterator[bytes]:
    """All inputs of the cached data: format, versions of libraries, description, robot files."""
    yield FORMAT.encode()
    yield f"{pin.__version__} {coal.__version__} {np.__version__}".encode()
    # No cached data depend on the ranking of candidates. The trunk volume is not cached: it takes
    # little time to compute.
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
