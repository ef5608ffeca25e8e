"""A roadmap of roots that can be kept between requests, and repaired where the scene changed."""

from __future__ import annotations

import hashlib
from collections import OrderedDict
from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components, dijkstra

from rbprm_core.guide.guide_options import GuideOptions
from rbprm_core.guide.root_space import RootSpace
from rbprm_core.robot.data import RobotData
from rbprm_core.scene import Scene
from rbprm_core.scene.changes import changed_boxes

Array = NDArray[np.float64]


@dataclass
class Node:
    """A root configuration (7 + j,) of a roadmap.

    Attributes:
        passing: needed by one request alone; dropped when the next comes.
        doubtful: the scene changed near it since it was tested.
    """

    root: Array
    passing: bool = False
    doubtful: bool = False


class Roadmap:
    """Roots and the straight edges between them that hold.

    A node has a number of its own for as long as it lives. An edge or a node near which the scene
    changed is doubtful until somebody tests it again (`confirm`, `drop_node`, `drop_edge`).
    """

    def __init__(self) -> None:
        self.nodes: dict[int, Node] = {}
        self._links: dict[int, dict[int, bool]] = {}  # doubtful, by both of an edge's nodes
        self._next = 0
        self._scene: Scene | None = None

    def __len__(self) -> int:
        return len(self.nodes)

    def edges(self) -> list[tuple[int, int]]:
        """The pairs of nodes that are joined, the lower number first."""
        return [(i, j) for i, links in self._links.items() for j in links if i < j]

    def doubtful(self, i: int, j: int) -> bool:
        """True where an edge, or one of its ends, was not tested in the scene as it is now."""
        return self._links[i][j] or self.nodes[i].doubtful or self.nodes[j].doubtful

    def open(self, scene: Scene, radius: float) -> None:
        """Begin a request: forget what the last alone needed, and doubt what the scene's changes
        since then may have touched.

        Args:
            radius: metres around a root's position within which the scene decides about it.
        """
        for i in [i for i, node in self.nodes.items() if node.passing]:
            self.drop_node(i)
        if self._scene is not None and self._scene is not scene:
            self._doubt(changed_boxes(self._scene, scene), radius)
        self._scene = scene

    def add(self, root: Array, seen: Iterable[int], passing: bool = False) -> int:
        """Add a node with tested edges to the nodes it sees; returns its number."""
        number, self._next = self._next, self._next + 1
        self.nodes[number] = Node(root.copy(), passing)
        self._links[number] = {}
        for other in seen:
            self.confirm(number, other)
        return number

    def confirm(self, i: int, j: int) -> None:
        """Note an edge, and its ends, as tested in the scene as it is now."""
        self._links[i][j] = self._links[j][i] = False
        self.nodes[i].doubtful = self.nodes[j].doubtful = False

    def drop_edge(self, i: int, j: int) -> None:
        """Forget an edge."""
        del self._links[i][j], self._links[j][i]

    def drop_node(self, i: int) -> None:
        """Forget a node with its edges."""
        for j in self._links.pop(i):
            del self._links[j][i]
        del self.nodes[i]

    def parts(self, without: Collection[tuple[int, int]] = ()) -> dict[int, int]:
        """For each node the label of the connected part that it belongs to.

        Args:
            without: edges, the lower number first, that connect nothing.
        """
        numbers, graph = self._graph(lambda i, j: np.inf if (i, j) in without else 1.0)
        _, labels = connected_components(graph, directed=False)
        return dict(zip(numbers, labels.tolist(), strict=True))

    def shortest(
        self, start: int, goal: int, cost: Callable[[int, int], float]
    ) -> list[int] | None:
        """Numbers of the nodes on the cheapest way, None where there is none.

        Args:
            cost: of an edge, positive; infinite where it must not be taken.
        """
        numbers, graph = self._graph(cost)
        first, last = numbers.index(start), numbers.index(goal)
        costs, before = dijkstra(graph, directed=False, indices=first, return_predecessors=True)
        if not np.isfinite(costs[last]):
            return None
        way = [last]
        while way[-1] != first:
            way.append(int(before[way[-1]]))
        return [numbers[i] for i in way[::-1]]

    def _graph(self, cost: Callable[[int, int], float]) -> tuple[list[int], coo_array]:
        numbers = list(self.nodes)
        place = {number: i for i, number in enumerate(numbers)}
        priced = [(i, j, cost(i, j)) for i, j in self.edges()]
        entries = [(place[i], place[j], c) for i, j, c in priced if np.isfinite(c)]
        rows, columns, costs = np.array(entries).reshape(-1, 3).T
        shape = (len(numbers), len(numbers))
        return numbers, coo_array((costs, (rows.astype(int), columns.astype(int))), shape=shape)

    def _doubt(self, boxes: Array, radius: float) -> None:
        """Doubt nodes and edges whose swept box, `radius` wide around it, meets one of some boxes.

        An edge's box contains those of its ends.
        """
        edges = self.edges()
        if len(boxes) == 0 or not self.nodes:
            return
        for node in self.nodes.values():
            node.doubtful |= _touched(node.root[None, :3], boxes, radius)
        for i, j in edges:
            ends = np.array([self.nodes[i].root[:3], self.nodes[j].root[:3]])
            if _touched(ends, boxes, radius):
                self._links[i][j] = self._links[j][i] = True


def _touched(ends: Array, boxes: Array, radius: float) -> bool:
    low, high = ends.min(axis=0) - radius, ends.max(axis=0) + radius
    return bool(((boxes[:, 0] <= high) & (boxes[:, 1] >= low)).all(axis=1).any())


class RoadmapStore:
    """Roadmaps that a caller keeps between requests; the least recently used goes first.

    Not thread-safe; to be given to one plan at a time.

    Args:
        capacity: most roadmaps kept.
    """

    def __init__(self, capacity: int = 8) -> None:
        self._capacity = capacity
        self._kept: OrderedDict[str, Roadmap] = OrderedDict()

    def __len__(self) -> int:
        return len(self._kept)

    def roadmap(self, key: str, scene: Scene, radius: float) -> Roadmap:
        """The roadmap of a key, empty where there is none yet, opened for a scene.

        Args:
            key: see `roadmap_key`. radius: see `Roadmap.open`.
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
    """A key that two requests share where a root or an edge that holds for one does for the other.

    Start, goal and scene are no part of it: a roadmap serves any of the first two, and is repaired
    for the third.
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
