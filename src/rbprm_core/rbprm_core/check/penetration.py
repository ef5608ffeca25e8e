"""Collision of the robot with the environment and with itself, on the unsimplified geometry.

Whether a link collides with the environment is decided on its unsimplified geometry. Its depth is
then the largest one over all environment triangles that the link intersects or contains. The depth
of a triangle is the length of the shortest translation that separates it from the convex hull of
the link (EPA). Since the hull contains the link, and leaving the environment means leaving each
triangle, this depth is

- never smaller than the depth below the hull's surface of any point of the environment in the link,
- greater than the depth of the link itself only where the hull fills a concavity of the link. So
  the check may refuse a plan that a finer measure would accept, and never accepts one that a finer
  measure would refuse.

A mesh contains a triangle without intersecting it if its surface does not meet the triangle. Such
triangles intersect the hull and have a corner inside the mesh, by winding number.

One triangle can be left backwards, into the solid. So if the hull's centre is inside the
environment, the depth is at least the distance from the centre to the environment's surface plus
the radius of the ball about the centre that the hull contains. "Inside" is decided by winding
number, and for the link at a contact also by the plane of the contact, which covers open surfaces.

Surfaces that do not intersect can still be nested: a link is inside a solid if a vertex of one of
its components is, and a piece of the environment is inside a link mesh if one of its vertices is.

Not detected are a link completely behind a sheet without thickness, and the full depth of a part
thinner than the bound in a finely triangulated solid that contains less than half of the link.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import coal
import numpy as np
import pinocchio as pin

from rbprm_core.arrays import Array
from rbprm_core.check.link_geometry import LinkGeometry
from rbprm_core.check.plan_environment import Environment
from rbprm_core.check.poses import unit
from rbprm_core.check.robot_model import Robot
from rbprm_core.check.triangle_geometry import triangle_distances
from rbprm_core.check.violation import Kind, Violation
from rbprm_core.plan_record import ContactEntry, StateEntry

DEPTH_BOUND = 2e-3  # metres that a link may be in the environment
CONTACT_DEPTH_BOUND = 10e-3  # metres for the link at a contact: soles have round edges
CONTACT_DISTANCE_BOUND = 10e-3  # metres between a contact point and the robot, for the same reason

POINT_SHAPE = coal.Sphere(1e-9)
MAX_CONTACTS = 1_000_000  # required by coal; more than the pairs of triangles of any mesh here


class CollisionCheck:
    """Checks a robot for collisions at the state at which it is placed.

    Args:
        robot: robot of the plan.
        environment: environment of the plan.

    Attributes:
        robot: robot of the plan.
        environment: environment of the plan.
        links: collision geometries, in the order of pinocchio's geometry model.
        deepest: greatest depth in the environment so far, metres.
    """

    def __init__(self, robot: Robot, environment: Environment) -> None:
        self.robot, self.environment = robot, environment
        self.links = [
            LinkGeometry(robot.model.frames[g.parentFrame].name, int(g.parentFrame), g.geometry)
            for g in robot.geometry.geometryObjects
        ]
        for link in self.links:
            link.geometry.computeLocalAABB()
        self.deepest = 0.0
        self._request = coal.CollisionRequest(coal.CollisionRequestFlag.CONTACT, MAX_CONTACTS)

    def state_violations(self, state: StateEntry, index: int) -> Iterator[Violation]:
        """Yield the collisions of the placed robot; see the module for the meaning of depth.

        Args:
            state: state at which the robot is placed.
            index: its index.
        """
        contacts = {self._contact_link(c, index, k): c for k, c in enumerate(state.contacts)}
        for k, link in enumerate(self.links):
            contact = contacts.get(link.frame)
            depth = self._depth(link, self.robot.geometry_data.oMg[k], contact)
            self.deepest = max(self.deepest, depth)
            bound = DEPTH_BOUND if contact is None else CONTACT_DEPTH_BOUND
            if depth > bound:
                text = f"link {link.link} {1e3 * depth:.1f} mm deep in the environment"
                text += f" (at most {1e3 * bound:.1f} mm)"
                limb = "" if contact is None else contact.limb
                yield Violation(index, limb, Kind.COLLISION, text)
        yield from self._self_collisions(index)

    def contact_distance_violations(
        self, contact: ContactEntry, index: int, field: str
    ) -> Iterator[Violation]:
        """Yield a violation if a point of a contact is not on the robot itself.

        It has to be on the rigid body of the contact's frame: on one of the links that are fixed to
        it, by the convex hulls of their geometries, so that no contact is refused that a finer
        measure would accept. Rigid bodies without collision geometry are not checked.

        Args:
            contact: contact of the state at which the robot is placed.
            index: index of the state.
            field: name of the contact in errors.
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
        if farthest > CONTACT_DISTANCE_BOUND:
            text = f"contact point {1e3 * farthest:.1f} mm from the robot's own geometry"
            text += f" (at most {1e3 * CONTACT_DISTANCE_BOUND:.1f} mm)"
            yield Violation(index, contact.limb, Kind.OFF_ROBOT, text)

    def _distance(self, indices: list[int], point: Array) -> float:
        """Return the distance of a point (3,) from the nearest of some hulls, metres; 0 inside."""
        minimum = np.inf
        for k in indices:
            placement = self.robot.geometry_data.oMg[k]
            pose = coal.Transform3s(placement.rotation, placement.translation)
            at = coal.Transform3s(np.eye(3), point)
            request, result = coal.DistanceRequest(), coal.DistanceResult()
            distance = coal.distance(POINT_SHAPE, at, self.links[k].convex, pose, request, result)
            minimum = min(minimum, max(float(distance), 0.0))
        return minimum

    def _contact_link(self, contact: ContactEntry, state: int, k: int) -> int:
        """Return the frame index of the link at the k-th contact of a state."""
        field = f"states.{state}.contacts.{k}.frame"
        return self.robot.contact_link(self.robot.frame(contact.frame, field))

    def _self_collisions(self, index: int) -> Iterator[Violation]:
        """Yield the pairs of links that collide."""
        geometry, data = self.robot.geometry, self.robot.geometry_data
        pin.computeCollisions(geometry, data, False)
        for pair, result in zip(geometry.collisionPairs, data.collisionResults, strict=True):
            if result.isCollision():
                first, second = self.links[pair.first].link, self.links[pair.second].link
                text = f"links {first} and {second} collide"
                yield Violation(index, "", Kind.SELF_COLLISION, text)

    def _depth(self, link: LinkGeometry, placement: pin.SE3, contact: ContactEntry | None) -> float:
        """Return the depth of a link in the environment, metres; 0 without collision.

        Args:
            link: geometry of the link.
            placement: pose of the geometry in the planning frame.
            contact: contact at which the link touches the environment, if any.
        """
        hit = self._hit_triangles(link.geometry, placement)
        if not hit:
            return self._nested_depth(link, placement)
        depths = self._hit_triangles(link.convex, placement) if link.is_mesh else hit
        depth = max(
            (depths[k] for k in depths if k in hit or self._has_corner_in(link, placement, k)),
            default=0.0,
        )
        return max(depth, self._depth_of_centre(link, placement, contact))

    def _hit_triangles(self, geometry: Any, placement: pin.SE3) -> dict[int, float]:
        """Return the environment triangles that a geometry intersects, and the depth of each.

        Depths are in metres, and meaningful for convex geometries only.
        """
        pose = coal.Transform3s(placement.rotation, placement.translation)
        result = coal.CollisionResult()
        bvh, request = self.environment.bvh, self._request
        coal.collide(bvh, coal.Transform3s(), geometry, pose, request, result)
        return {int(c.b1): -float(c.penetration_depth) for c in result.getContacts()}

    def _has_corner_in(self, link: LinkGeometry, placement: pin.SE3, triangle: int) -> bool:
        """Return whether an environment triangle has a corner inside a link mesh."""
        corners = self.environment.triangles[triangle] - placement.translation
        return any(link.contains(corner) for corner in corners @ placement.rotation)

    def _depth_of_centre(
        self, link: LinkGeometry, placement: pin.SE3, contact: ContactEntry | None
    ) -> float:
        """Return the depth that follows from the hull's centre being inside; 0 if it is not."""
        centre, radius = link.inscribed_ball
        point = np.array(placement * centre)
        depth = 0.0
        if self.environment.contains(point):
            depth = radius + self.environment.distance(point)
        if contact is not None:
            below = float((np.array(contact.position) - point) @ unit(contact.normal))
            depth = max(depth, radius + below if below > 0 else 0.0)
        return depth

    def _nested_depth(self, link: LinkGeometry, placement: pin.SE3) -> float:
        """Return the depth of a link that intersects no triangle; 0 unless one is in the other."""
        environment = self.environment
        points = [np.array(placement * point) for point in link.sample_points]
        inside = [environment.distance(p) for p in points if environment.contains(p)]
        if inside:
            return max(*inside, self._depth_of_centre(link, placement, None))
        return self._contained_depth(link, placement) if link.is_mesh else 0.0

    def _contained_depth(self, link: LinkGeometry, placement: pin.SE3) -> float:
        """Return the depth of environment pieces inside a link mesh without touching it, metres."""
        environment = self.environment
        box = link.geometry.aabb_local
        points = (environment.piece_points - placement.translation) @ placement.rotation
        deepest = 0.0
        for k in np.flatnonzero(((box.min_ <= points) & (points <= box.max_)).all(axis=1)):
            if link.contains(points[k]):
                corners = environment.triangles[environment.pieces[k]].reshape(-1, 3)
                local = (corners - placement.translation) @ placement.rotation
                depths = [triangle_distances(link.triangles, corner).min() for corner in local]
                deepest = max(deepest, *depths)
        return deepest
