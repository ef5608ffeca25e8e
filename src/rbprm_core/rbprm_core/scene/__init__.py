"""The environment in which a robot plans: planar contact surfaces and obstacles."""

from rbprm_core.scene.mesh import MeshSource, read_triangles, surfaces_from_mesh
from rbprm_core.scene.scene import Scene
from rbprm_core.scene.surface import Classification, Surface, make_surface

__all__ = [
    "Classification",
    "MeshSource",
    "Scene",
    "Surface",
    "make_surface",
    "read_triangles",
    "surfaces_from_mesh",
]
