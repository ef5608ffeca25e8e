"""The robot's visual geometry: one mesh for each joint that carries some. Metres."""

from __future__ import annotations

from dataclasses import dataclass

import coal
import numpy as np
import pinocchio as pin
import trimesh

from rbprm_core.errors import InvalidInput
from rbprm_core.resources import share_folders
from rbprm_core.view.meshes import joined


@dataclass(frozen=True, eq=False)
class Link:
    """All that is rigidly attached to one joint.

    Attributes:
        joint: index of the joint in the pinocchio model.
        mesh: its visual geometry in the joint's frame.
        limb: the limb that makes contact with it, "" for the rest of the body.
    """

    joint: int
    mesh: trimesh.Trimesh
    limb: str


def read_links(model: pin.Model, urdf: str, tips: dict[int, str]) -> tuple[Link, ...]:
    """Visual geometry of a URDF by joint.

    Args:
        model: built from the same file.
        urdf: its absolute path.
        tips: names of the limbs that make contact, by the joint that carries the contact frame.

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
        # the legs share their meshes: each file is taken over once
        key = (item.meshPath, tuple(item.meshScale))
        primitive = not isinstance(item.geometry, coal.BVHModelBase)
        mesh = _as_mesh(item.geometry) if primitive or key not in read else read[key]
        if not primitive:
            read[key] = mesh
        placed = mesh.copy().apply_transform(item.placement.homogeneous)
        parts.setdefault(item.parentJoint, []).append(placed)
    return tuple(
        Link(joint, joined(meshes), tips.get(joint, "")) for joint, meshes in sorted(parts.items())
    )


def _as_mesh(shape: coal.CollisionGeometry) -> trimesh.Trimesh:
    """Triangles of a shape in its own frame, metres; nothing for a shape of another kind."""
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
            # trimesh too centres a capsule on its frame and counts its height without the caps
            mesh = trimesh.creation.capsule(2 * shape.halfLength, shape.radius, count=[16, 16])
    return mesh
