"""The environment of the service SetEnvironment: from a mesh file, or from polygons."""

from __future__ import annotations

import re
from importlib.util import find_spec
from pathlib import Path

from geometry_msgs.msg import Pose as PoseMessage
from rbprm_msgs.srv import SetEnvironment

from rbprm_core.errors import InvalidInput
from rbprm_core.placement import Placement
from rbprm_core.resources import find_resource
from rbprm_core.scene import MeshSource, read_triangles
from rbprm_core.validation import MAX_FRICTION, finite_number
from rbprm_ros.conversions.geometry import placement_of_message, quadruple, triple
from rbprm_ros.conversions.meshes import MIN_TRIANGLE, areas, require_triangles
from rbprm_ros.conversions.surfaces import update_of_message
from rbprm_ros.environment.updates import MeshUpdate, SurfaceUpdate
from rbprm_ros.settings import Settings

PACKAGE_URI = re.compile(r"package://([A-Za-z0-9_-]+)/(.+)", flags=re.DOTALL)
UNSET = (0.0,) * 7


def update_of_setting(message: SetEnvironment.Request, settings: Settings) -> SurfaceUpdate:
    """The snapshot that a call sets: a mesh file, or polygons and obstacles.

    Args:
        message: request of the call.
        settings: parameters of the node.

    Raises:
        InvalidInput: the request has both or neither, a change instead of a snapshot, or a snapshot
            that cannot be used; names the field.
    """
    given = message.environment
    has_polygons = bool(given.surfaces or given.obstacles)
    if bool(message.mesh) == has_polygons:
        reason = "give either this or surfaces and obstacles in environment"
        raise InvalidInput("mesh", message.mesh, reason)
    if message.mesh:
        return snapshot_update(message.mesh, message.pose, message.friction, settings)
    if given.is_diff:
        reason = "must be false: publish changes on ~/surfaces"
        raise InvalidInput("environment.is_diff", given.is_diff, reason)
    try:
        return update_of_message(given, settings)
    except InvalidInput as error:
        raise InvalidInput(f"environment.{error.field}", error.value, error.reason) from error


def snapshot_update(
    mesh: str, pose: PoseMessage, friction: float, settings: Settings
) -> SurfaceUpdate:
    """A snapshot of one mesh file: its contact surfaces, and the rest of the mesh as an obstacle.

    Args:
        mesh: "package://NAME/path" in the share folder of a ROS package, in the share folder of a
            Python package, or in the Python package itself; else a path, relative to a share folder
            or absolute.
        pose: pose of the mesh's frame in the planning frame; all zero stands for the identity.
        friction: coefficient of Coulomb friction of the surfaces.
        settings: parameters of the node.

    Raises:
        InvalidInput: `mesh`, `pose` or `friction` cannot be used.
    """
    friction = finite_number("friction", friction, low=0.0, high=MAX_FRICTION)
    unset = (*triple(pose.position), *quadruple(pose.orientation)) == UNSET
    placement = Placement.parse((0, 0, 0)) if unset else placement_of_message(pose, "pose")
    transform = placement.transform
    path = mesh_path(mesh)
    try:
        source = MeshSource(str(path), transform.translation, transform.rotation, friction)
        triangles = read_triangles(source)
    except InvalidInput as error:
        raise InvalidInput("mesh", mesh, error.reason) from error
    require_triangles("mesh", len(triangles), settings)
    triangles = triangles[areas(triangles) >= MIN_TRIANGLE]
    if not len(triangles):
        raise InvalidInput("mesh", mesh, "has no triangle with an area; is it in metres?")
    return SurfaceUpdate(
        meshes=(MeshUpdate(path.stem, triangles, friction),),
        classification=settings.classification,
    )


def mesh_path(mesh: str) -> Path:
    """Path of a mesh file.

    Args:
        mesh: name of the mesh; see `snapshot_update`.

    Raises:
        InvalidInput: no such file or package; the text lists the searched folders.
    """
    uri = PACKAGE_URI.fullmatch(mesh)
    if mesh.startswith("package:") and uri is None:
        raise InvalidInput("mesh", mesh, 'must be "package://NAME/path" or a path')
    name = mesh if uri is None else f"{uri[1]}/{uri[2]}"
    try:
        inside = None if uri is None else _in_python_package(uri[1], uri[2])
        return inside or find_resource(name, "mesh")
    except InvalidInput as error:
        reason = f"{error.reason}; give an absolute path, or the package that ships the file"
        raise InvalidInput("mesh", mesh, reason) from error
    except OSError as error:  # the name cannot be the name of a file
        raise InvalidInput("mesh", mesh, f"cannot be a file: {error.strerror}") from error


def _in_python_package(package: str, path: str) -> Path | None:
    """Path of a file in a Python package; None where there is none."""
    spec = find_spec(package)
    folders = [] if spec is None else list(spec.submodule_search_locations or ())
    return next((p for p in (Path(folder) / path for folder in folders) if p.is_file()), None)
