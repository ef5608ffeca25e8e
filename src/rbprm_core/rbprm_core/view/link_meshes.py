"""The robot's visual geometry as one mesh for each joint, in metres."""

from __future__ import annotations

from dataclasses import dataclass

import coal
import numpy as np
import pinocchio as pin
import trimesh

from rbprm_core.errors import InvalidInput
from rbprm_core.resources import share_folders
from rbprm_core.view.mesh_operations import joined


@dataclass(frozen=True, eq=False)
class LinkMesh:
    """The visual geometry of all links that are rigidly attached to one joint.

    Attributes:
        joint: index of the joint in the pinocchio model.
        mesh: visual geometry, metres, in the frame of the joint.
        limb: name of the limb that makes contact with these links, "" if none does.
    """

    joint: int
    mesh: trimesh.Trimesh
    limb: str


def load_link_meshes(model: pin.Model, urdf: str, limbs: dict[int, str]) -> tuple[LinkMesh, ...]:
    """Return the visual geometry of a URDF, one mesh for each joint that has some.

    Args:
        model: model with a floating base, built from the same URDF.
        urdf: absolute path of the URDF.
        limbs: name of the limb that makes contact with the links of a joint, by index of the joint.

    Raises:
        InvalidInput: a mesh is missing or unreadable.
    """
    shares = share_folders()
    folders = [str(f) for share in shares for f in (share, share / "example-robot-data" / "robots")]
    try:
        geometry = pin.buildGeomFromUrdf(model, urdf, pin.VISUAL, package_dirs=folders)
    except (RuntimeError, ValueError) as error:
        reason = f"its visual meshes cannot be read: {error}"
        raise InvalidInput("robot.urdf", urdf, reason) from error
    read: dict[tuple[str, tuple[float, ...]], trimesh.Trimesh] = {}
    parts: dict[int, list[trimesh.Trimesh]] = {}
    for item in geometry.geometryObjects:
        # legs share their meshes: each file is converted once
        key = (item.meshPath, tuple(item.meshScale))
        primitive = not isinstance(item.geometry, coal.BVHModelBase)
        mesh = _as_mesh(item.geometry) if primitive or key not in read else read[key]
        if not primitive:
            read[key] = mesh
        placed = mesh.copy().apply_transform(item.placement.homogeneous)
        parts.setdefault(item.parentJoint, []).append(placed)
    return tuple(
        LinkMesh(joint, joined(meshes), limbs.get(joint, ""))
        for joint, meshes in sorted(parts.items())
    )


def _as_mesh(shape: coal.CollisionGeometry) -> trimesh.Trimesh:
    """Return a shape as triangles in its own frame, metres; none for an unsupported shape."""
    mesh = trimesh.Trimesh()
    match shape:
        case coal.BVHModelBase():
            triangles = (shape.tri_indices(i) for i in range(shape.num_tris))
            faces = np.array([(t[0], t[1], t[2]) for t in triangles])
            mesh = trimesh.Trimesh(shape.vertices().copy(), faces)
        case coal.Box():
            mesh = trimesh.creation.box(2 * shape.halfSide)
        case coal.Sphere():
            mesh = trimesh.creation.icosphere(subdivisions=2, radius=shape.radius)
        case coal.Cylinder():
            mesh = trimesh.creation.cylinder(shape.radius, 2 * shape.halfLength, sections=32)
        case coal.Capsule():
            # trimesh too centres a capsule on its frame and measures its height without the caps
            mesh = trimesh.creation.capsule(2 * shape.halfLength, shape.radius, count=[16, 16])
    return mesh
