"""Collision of the robot with the environment and with itself, on the URDF's raw geometry.

Depth against the environment. Whether a link meets the environment is asked of the raw geometry.
How deep is then, per environment triangle that the link meets or holds, the least translation that
frees the convex hull of the link from that triangle (EPA); the depth is the greatest of these.
Since a hull holds its link and leaving the environment means leaving each triangle, this is

- never less than how far any met point of the environment lies below the surface of the hull,
- more than the depth of the link alone only where the hull fills a hollow of the link: the check
  may then refuse what a finer measure would pass, never the other way round.

The triangles that a link mesh holds, and whose crossing no query of two surfaces reports, are those
that meet the hull and have a corner inside the mesh, by winding number.

A lone triangle can be left backwards, into the solid. So if the centre of the hull is inside, the
depth is at least the centre's distance to the surface plus the radius of the ball about the centre
that the hull holds: two balls that meet have to part. "Inside" is by winding number, and for the
link that stands on a contact also behind the contact's plane, which serves open sheets.

Surfaces that do not meet can still be nested: a link is inside a solid if one vertex of each of its
pieces is, a piece of the environment is inside a link mesh if one of its vertices is.

What stays unseen: a link wholly behind a sheet without thickness, and the full depth of a part
thinner than the bound pushed into a finely triangulated solid by less than half of the link.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import coal
import numpy as np
import pinocchio as pin
import trimesh
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from rbprm_core.check.environment import (
    INSIDE,
    Environment,
    by_corner,
    mesh_triangles,
    triangle_distances,
    vertex_bodies,
    winding_number,
)
from rbprm_core.check.kinematics import Robot
from rbprm_core.check.poses import unit
from rbprm_core.check.report import Kind, Violation
from rbprm_core.errors import InvalidInput
from rbprm_core.plan_record import ContactEntry, StateEntry

DEPTH_BOUND = 2e-3
STANDING_DEPTH_BOUND = 10e-3
REACH_BOUND = 10e-3  # as far as a link may sink into what it stands on: soles have round edges

PROBE = coal.Sphere(1e-9)
ALL_CONTACTS = 1_000_000  # coal wants a number; no mesh here has as many pairs of triangles


@dataclass(frozen=True)
class Body:
    """One collision geometry of the robot, in its own frame.

    Attributes:
        link: name of the URDF link.
        frame: index of the link's frame.
        geometry: the raw geometry, for coal.
    """

    link: str
    frame: int
    geometry: Any

    @cached_property
    def is_mesh(self) -> bool:
        """Whether the geometry is a surface; the others are solid."""
        return isinstance(self.geometry, coal.BVHModelOBBRSS)

    @cached_property
    def triangles(self) -> NDArray[np.float64]:
        """Triangles (n, 3, 3) of a mesh."""
        return mesh_triangles(self.geometry)

    @cached_property
    def probes(self) -> NDArray[np.float64]:
        """A point (k, 3) of every connected piece of the geometry."""
        if not self.is_mesh:
            return np.zeros((1, 3))
        _, first = np.unique(vertex_bodies(self.triangles), return_index=True)
        return np.asarray(self.triangles[first, 0])

    def holds(self, point: NDArray[np.float64]) -> bool:
        """Whether a point (3,) is inside a mesh; mirrored meshes are inside out."""
        return abs(winding_number(self._corners, point)) > INSIDE

    @cached_property
    def _corners(self) -> NDArray[np.float64]:
        return by_corner(self.triangles)

    @cached_property
    def convex(self) -> Any:
        """Convex shape for depths: the hull of a mesh, else the geometry itself."""
        if not self.is_mesh:
            return self.geometry
        self.geometry.buildConvexHull(True, "Qt")
        return self.geometry.convex

    @cached_property
    def ball(self) -> tuple[NDArray[np.float64], float]:
        """Centre (3,) of the convex shape, and the radius of the ball about it that it holds.

        Raises:
            InvalidInput: a flat mesh, or a shape that URDF files do not have.
        """
        shape = self.geometry
        if isinstance(shape, coal.Sphere):
            return np.zeros(3), float(shape.radius)
        if isinstance(shape, coal.Cylinder | coal.Capsule):
            return np.zeros(3), float(min(shape.radius, shape.halfLength))
        if isinstance(shape, coal.Box):
            return np.zeros(3), float(np.min(shape.halfSide))
        if not self.is_mesh:
            raise InvalidInput("robot.urdf", self.link, f"has a {type(shape).__name__} geometry")
        try:
            planes = ConvexHull(np.array(shape.vertices())).equations
        except QhullError as error:
            raise InvalidInput("robot.urdf", self.link, "has a flat collision mesh") from error
        centre = np.array(trimesh.convex.convex_hull(np.array(shape.vertices())).center_mass)
        return centre, float(-(planes[:, :3] @ centre + planes[:, 3]).max())


class Collisions:
    """Collision queries of a robot in an environment.

    Attributes:
        deepest: greatest depth against the environment met so far, metres.
    """

    def __init__(self, robot: Robot, environment: Environment) -> None:
        self.robot, self.environment = robot, environment
        self.bodies = [
            Body(robot.model.frames[g.parentFrame].name, int(g.parentFrame), g.geometry)
            for g in robot.geometry.geometryObjects
        ]
        for body in self.bodies:
            body.geometry.computeLocalAABB()
        self.deepest = 0.0
        self._request = coal.CollisionRequest(coal.CollisionRequestFlag.CONTACT, ALL_CONTACTS)

    def state_violations(self, state: StateEntry, index: int) -> Iterator[Violation]:
        """Collisions of the placed robot; see the module's text for what depth means."""
        standing = {self._standing_link(c, index, k): c for k, c in enumerate(state.contacts)}
        for k, body in enumerate(self.bodies):
            contact = standing.get(body.frame)
            depth = self._depth(body, self.robot.geometry_data.oMg[k], contact)
            self.deepest = max(self.deepest, depth)
            bound = DEPTH_BOUND if contact is None else STANDING_DEPTH_BOUND
            if depth > bound:
                text = f"link {body.link} {1e3 * depth:.1f} mm deep in the environment"
                text += f" (at most {1e3 * bound:.1f} mm)"
                limb = "" if contact is None else contact.limb
                yield Violation(index, limb, Kind.COLLISION, text)
        yield from self._self_collisions(index)

    def reach_violations(
        self, contact: ContactEntry, index: int, field: str
    ) -> Iterator[Violation]:
        """A contact with a point that the robot itself does not reach.

        The rigid body that carries the contact's frame has to: all links fixed to it, by the hulls
        of their geometries, so that no contact is refused that a finer measure would pass. Of a
        body without collision geometry nothing can be said.
        """
        frame = self.robot.model.frames[self.robot.frame(contact.frame, f"{field}.frame")]
        rigid = [
            k
            for k, geometry in enumerate(self.robot.geometry.geometryObjects)
            if geometry.parentJoint == frame.parentJoint
        ]
        if not rigid:
            return
        farthest = max(self._distance(rigid, np.array(point)) for point in contact.points)
        if farthest > REACH_BOUND:
            text = f"contact point {1e3 * farthest:.1f} mm from the robot's own geometry"
            text += f" (at most {1e3 * REACH_BOUND:.1f} mm)"
            yield Violation(index, contact.limb, Kind.OFF_ROBOT, text)

    def _distance(self, bodies: list[int], point: NDArray[np.float64]) -> float:
        """Distance of a point (3,) to the nearest hull of some bodies, metres; 0 inside."""
        least = np.inf
        for k in bodies:
            placement = self.robot.geometry_data.oMg[k]
            pose = coal.Transform3s(placement.rotation, placement.translation)
            at = coal.Transform3s(np.eye(3), point)
            request, result = coal.DistanceRequest(), coal.DistanceResult()
            distance = coal.distance(PROBE, at, self.bodies[k].convex, pose, request, result)
            least = min(least, max(float(distance), 0.0))
        return least

    def _standing_link(self, contact: ContactEntry, state: int, k: int) -> int:
        field = f"states.{state}.contacts.{k}.frame"
        return self.robot.standing_link(self.robot.frame(contact.frame, field))

    def _self_collisions(self, index: int) -> Iterator[Violation]:
        geometry, data = self.robot.geometry, self.robot.geometry_data
        pin.computeCollisions(geometry, data, False)
        for pair, result in zip(geometry.collisionPairs, data.collisionResults, strict=True):
            if result.isCollision():
                first, second = self.bodies[pair.first].link, self.bodies[pair.second].link
                text = f"links {first} and {second} collide"
                yield Violation(index, "", Kind.SELF_COLLISION, text)

    def _depth(self, body: Body, placement: pin.SE3, contact: ContactEntry | None) -> float:
        """Depth of a body at a placement in the environment, metres; 0 without collision."""
        met = self._met(body.geometry, placement)
        if not met:
            return self._nested_depth(body, placement)
        depths = self._met(body.convex, placement) if body.is_mesh else met
        depth = max(
            (depths[k] for k in depths if k in met or self._holds(body, placement, k)), default=0.0
        )
        return max(depth, self._depth_of_centre(body, placement, contact))

    def _met(self, geometry: Any, placement: pin.SE3) -> dict[int, float]:
        """Environment triangles that a geometry meets; of a convex one the depths, metres."""
        pose = coal.Transform3s(placement.rotation, placement.translation)
        result = coal.CollisionResult()
        bvh, request = self.environment.bvh, self._request
        coal.collide(bvh, coal.Transform3s(), geometry, pose, request, result)
        return {int(c.b1): -float(c.penetration_depth) for c in result.getContacts()}

    def _holds(self, body: Body, placement: pin.SE3, triangle: int) -> bool:
        """Whether a triangle of the environment has a corner inside a link mesh."""
        corners = self.environment.triangles[triangle] - placement.translation
        return any(body.holds(corner) for corner in corners @ placement.rotation)

    def _depth_of_centre(
        self, body: Body, placement: pin.SE3, contact: ContactEntry | None
    ) -> float:
        """Least depth that follows from the hull's centre being inside, metres; 0 if it is not."""
        centre, radius = body.ball
        point = np.array(placement * centre)
        depth = 0.0
        if self.environment.contains(point):
            depth = radius + self.environment.distance(point)
        if contact is not None:
            below = float((np.array(contact.position) - point) @ unit(contact.normal))
            depth = max(depth, radius + below if below > 0 else 0.0)
        return depth

    def _nested_depth(self, body: Body, placement: pin.SE3) -> float:
        """Depth of a body that meets no triangle, metres: 0 unless one holds the other."""
        environment = self.environment
        probes = [np.array(placement * probe) for probe in body.probes]
        inside = [environment.distance(p) for p in probes if environment.contains(p)]
        if inside:
            return max(*inside, self._depth_of_centre(body, placement, None))
        return self._held_depth(body, placement) if body.is_mesh else 0.0

    def _held_depth(self, body: Body, placement: pin.SE3) -> float:
        """Depth of pieces of the environment that a link mesh holds without touching, metres."""
        environment = self.environment
        box = body.geometry.aabb_local
        points = (environment.body_points - placement.translation) @ placement.rotation
        deepest = 0.0
        for k in np.flatnonzero(((box.min_ <= points) & (points <= box.max_)).all(axis=1)):
            if body.holds(points[k]):
                corners = environment.triangles[environment.bodies[k]].reshape(-1, 3)
                local = (corners - placement.translation) @ placement.rotation
                depths = [triangle_distances(body.triangles, corner).min() for corner in local]
                deepest = max(deepest, *depths)
        return deepest
