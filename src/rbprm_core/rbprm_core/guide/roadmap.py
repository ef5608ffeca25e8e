"""Roadmap of root configurations that can be kept between requests and repaired after changes."""

from __future__ import annotations

import hashlib
from collections import OrderedDict
from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components, dijkstra

from rbprm_core.arrays import Array
from rbprm_core.guide.guide_options import GuideOptions
from rbprm_core.guide.root_space import RootSpace
from rbprm_core.robot.data import RobotData
from rbprm_core.scene import Scene
from rbprm_core.scene.changes import changed_boxes


@dataclass
class Node:
    """Node of a roadmap.

    Attributes:
        root: (7 + j,) root configuration.
        temporary: True for a node that only the current request needs; the next one removes it.
        unverified: True where the scene has changed near the node since it was tested.
    """

    root: Array
    temporary: bool = False
    unverified: bool = False


class Roadmap:
    """Graph of root configurations and valid straight segments between them.

    Nodes are identified by numbers, which are never reused. A node or edge near which the scene
    has changed is unverified until it is tested again and then confirmed (`confirm`) or removed
    (`remove_node`, `remove_edge`).
    """

    def __init__(self) -> None:
        self.nodes: dict[int, Node] = {}
        # Whether each edge is unverified, stored under both of its nodes.
        self._links: dict[int, dict[int, bool]] = {}
        self._next = 0
        self._scene: Scene | None = None

    def __len__(self) -> int:
        return len(self.nodes)

    def edges(self) -> list[tuple[int, int]]:
        """Pairs of numbers of connected nodes, the lower number first."""
        return [(i, j) for i, links in self._links.items() for j in links if i < j]

    def unverified(self, i: int, j: int) -> bool:
        """True where an edge or one of its ends has not been tested in the current scene.

        Args:
            i: number of one end.
            j: number of the other end.
        """
        return self._links[i][j] or self.nodes[i].unverified or self.nodes[j].unverified

    def open(self, scene: Scene, radius: float) -> None:
        """Prepare the roadmap for a request.

        Removes the temporary nodes of the last request and marks as unverified what changes of the
        scene since then may have touched.

        Args:
            scene: scene of the request.
            radius: distance from a root's position within which the scene decides about its
                validity, m.
        """
        for i in [i for i, node in self.nodes.items() if node.temporary]:
            self.remove_node(i)
        if self._scene is not None and self._scene is not scene:
            self._mark_unverified(changed_boxes(self._scene, scene), radius)
        self._scene = scene

    def add(self, root: Array, neighbours: Iterable[int], temporary: bool = False) -> int:
        """Add a node with valid edges to other nodes; returns its number.

        Args:
            root: (7 + j,) root configuration.
            neighbours: numbers of the nodes to which the segment is valid.
            temporary: True for a node that only the current request needs.
        """
        number, self._next = self._next, self._next + 1
        self.nodes[number] = Node(root.copy(), temporary)
        self._links[number] = {}
        for other in neighbours:
            self.confirm(number, other)
        return number

    def confirm(self, i: int, j: int) -> None:
        """Record an edge and its ends as valid in the current scene.

        Args:
            i: number of one end.
            j: number of the other end.
        """
        self._links[i][j] = self._links[j][i] = False
        self.nodes[i].unverified = self.nodes[j].unverified = False

    def remove_edge(self, i: int, j: int) -> None:
        """Remove the edge between two nodes.

        Args:
            i: number of one end.
            j: number of the other end.
        """
        del self._links[i][j], self._links[j][i]

    def remove_node(self, i: int) -> None:
        """Remove a node and its edges.

        Args:
            i: number of the node.
        """
        for j in self._links.pop(i):
            del self._links[j][i]
        del self.nodes[i]

    def components(self, without: Collection[tuple[int, int]] = ()) -> dict[int, int]:
        """Label of the connected component of each node, by the node's number.

        Args:
            without: edges that are ignored, as pairs with the lower number first.
        """
        numbers, graph = self._graph(lambda i, j: np.inf if (i, j) in without else 1.0)
        _, labels = connected_components(graph, directed=False)
        return dict(zip(numbers, labels.tolist(), strict=True))

    def shortest(
        self, start: int, goal: int, cost: Callable[[int, int], float]
    ) -> list[int] | None:
        """Numbers of the nodes on the cheapest path; None where no path exists.

        Args:
            start: number of the first node.
            goal: number of the last node.
            cost: positive cost of an edge, infinite where the path must not use it.
        """
        numbers, graph = self._graph(cost)
        first, last = numbers.index(start), numbers.index(goal)
        costs, before = dijkstra(graph, directed=False, indices=first, return_predecessors=True)
        if not np.isfinite(costs[last]):
            return None
        path = [last]
        while path[-1] != first:
            path.append(int(before[path[-1]]))
        return [numbers[i] for i in path[::-1]]

    def _graph(self, cost: Callable[[int, int], float]) -> tuple[list[int], coo_array]:
        """Numbers of all nodes, and the matrix of finite costs between them in that order."""
        numbers = list(self.nodes)
        place = {number: i for i, number in enumerate(numbers)}
        priced = [(i, j, cost(i, j)) for i, j in self.edges()]
        entries = [(place[i], place[j], c) for i, j, c in priced if np.isfinite(c)]
        rows, columns, costs = np.array(entries).reshape(-1, 3).T
        shape = (len(numbers), len(numbers))
        return numbers, coo_array((costs, (rows.astype(int), columns.astype(int))), shape=shape)

    def _mark_unverified(self, boxes: Array, radius: float) -> None:
        """Mark the nodes and edges whose swept bounding box, widened by a radius, meets a box.

        The box of an edge contains those of its ends.

        Args:
            boxes: (n, 2, 3) lowest and highest corners of the changed regions, m.
            radius: as in `open`, m.
        """
        edges = self.edges()
        if len(boxes) == 0 or not self.nodes:
            return
        for node in self.nodes.values():
            node.unverified |= _touched(node.root[None, :3], boxes, radius)
        for i, j in edges:
            ends = np.array([self.nodes[i].root[:3], self.nodes[j].root[:3]])
            if _touched(ends, boxes, radius):
                self._links[i][j] = self._links[j][i] = True


def _touched(ends: Array, boxes: Array, radius: float) -> bool:
    low, high = ends.min(axis=0) - radius, ends.max(axis=0) + radius
    return bool(((boxes[:, 0] <= high) & (boxes[:, 1] >= low)).all(axis=1).any())


class RoadmapStore:
    """Roadmaps that a caller keeps between requests; the least recently used is dropped first.

    Not thread-safe: pass it to one plan at a time.

    Args:
        capacity: maximum number of roadmaps.
    """

    def __init__(self, capacity: int = 8) -> None:
        self._capacity = capacity
        self._kept: OrderedDict[str, Roadmap] = OrderedDict()

    def __len__(self) -> int:
        return len(self._kept)

    def roadmap(self, key: str, scene: Scene, radius: float) -> Roadmap:
        """Roadmap of a key, opened for a scene; an empty one where the store has none.

        Args:
            key: see `roadmap_key`.
            scene: scene of the request.
            radius: see `Roadmap.open`, m.
        """
        found = self._kept.setdefault(key, Roadmap())
        found.open(scene, radius)
        self._kept.move_to_end(key)
        while len(self._kept) > self._capacity:
            self._kept.popitem(last=False)
        return found


def roadmap_key(
    data: RobotData,
    space: RootSpace,
    required: tuple[str, ...],
    options: GuideOptions,
    gravity: Array,
) -> str:
    """Key shared by all requests for which the same roots and edges are valid.

    Start, goal and scene are not part of the key: a roadmap serves any start and goal, and is
    repaired for another scene.

    Args:
        data: robot with its trunk volumes and limb workspaces.
        space: bounds of the root and of the joints planned with it.
        required: names of the limbs that must reach a surface.
        options: options of the guide.
        gravity: (3,) gravity, m/s^2; part of the key only with `options.equilibrium`.
    """
    robot, bounds = data.robot, space.bounds
    arrays = [
        *(piece.corners for piece in data.trunk), *data.workspaces, robot.reference,
        bounds.low, bounds.high, bounds.half_ranges, space.joint_low, space.joint_high,
    ]  # fmt: skip
    texts = [robot.description.model_dump_json(), *sorted(required), repr(options.resolution)]
    if options.equilibrium:
        arrays.append(gravity)
    digest = hashlib.blake2s()
    for part in [*(array.tobytes() for array in arrays), *(text.encode() for text in texts)]:
        digest.update(len(part).to_bytes(8, "little") + part)
    return digest.hexdigest()
