"""Error rates of the reachability condition for several scales s of the trunk volume.

The experiment is that of Tonneau et al. 2018, section 6.2.1 and table 1. Among random root
configurations, a false positive satisfies the condition although no contact configuration exists; a
false negative does not satisfy it although one exists.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rbprm_core.arrays import Array
from rbprm_core.body.contact import Contact
from rbprm_core.contacts.along_guide import ContactGenerator
from rbprm_core.contacts.along_guide.look_ahead import LookAhead
from rbprm_core.errors import InvalidInput
from rbprm_core.failures import Cause
from rbprm_core.guide.root import Reachability, RootSampler, RootSpace
from rbprm_core.guide.root.sampler import BATCH, effector_places
from rbprm_core.request import PlanRequest, limb_names
from rbprm_core.robot.data import RobotData
from rbprm_core.robot.volumes import trunk_volume
from rbprm_core.scene import Scene

DRAWS = 2_000  # roots drawn before the bounds are considered to exclude all roots
SCALES = (1.0, 1.1, 1.15, 1.2, 1.25, 1.5)  # the rows of Tonneau et al. 2018, table 1


@dataclass(frozen=True)
class ScaleCounts:
    """Numbers of root configurations that the condition classifies rightly and wrongly.

    Attributes:
        scale: scaling factor s of the trunk volume.
        true_positives: number at which the condition holds and a contact configuration was found.
        false_positives: number at which the condition holds and none was found.
        false_negatives: number at which the condition does not hold and one was found.
        true_negatives: number at which the condition does not hold and none was found.
    """

    scale: float
    true_positives: int
    false_positives: int
    false_negatives: int
    true_negatives: int

    @property
    def samples(self) -> int:
        """Number of all root configurations."""
        negatives = self.false_negatives + self.true_negatives
        return self.true_positives + self.false_positives + negatives

    @property
    def false_positive_rate(self) -> float:
        """Share of all root configurations that are false positives (table 1)."""
        return self.false_positives / self.samples

    @property
    def false_negative_rate(self) -> float:
        """Share of all root configurations that are false negatives (table 1)."""
        return self.false_negatives / self.samples

    @property
    def holds_rate(self) -> float:
        """Share of all root configurations at which the condition holds."""
        return (self.true_positives + self.false_positives) / self.samples

    @property
    def stands_rate(self) -> float:
        """Share of all root configurations at which a contact configuration was found."""
        return (self.true_positives + self.false_negatives) / self.samples


def calibrate(
    request: PlanRequest,
    data: RobotData,
    scene: Scene,
    samples: int,
    seed: int,
    *,
    scales: Sequence[float] = SCALES,
    tries: int = 3,
    report: Callable[[int], None] = lambda done: None,
) -> list[ScaleCounts]:
    """Counts of the condition's right and wrong classifications, one entry a scale.

    All scales are tested at the same roots. These are drawn as the guide planners draw them before
    any test: over the surfaces, within the request's bounds.

    Args:
        request: bounds, required limbs, gravity, grip force and options.
        data: data of the robot.
        scene: the scene.
        samples: number of root configurations.
        seed: seed of the roots and of the contact search.
        scales: scaling factors s of the trunk volume.
        tries: number of orders of the limbs in which contacts are searched for before a root counts
            as one without a contact configuration.
        report: function called with the number of roots done; may raise to stop.

    Raises:
        InvalidInput: bounds that contain no root over the surfaces.
    """
    rng = np.random.default_rng(seed)
    robot = data.robot
    required = limb_names(robot, request.required_limbs, "required_limbs")
    joints = robot.root_index[7:]
    space = RootSpace(request.bounds, robot.low[joints], robot.high[joints])
    conditions = [Reachability(_scaled(data, scale), scene, required) for scale in scales]
    reach = None if request.gravity.any() else effector_places(data)
    sampler = RootSampler(space, scene, conditions[0], data.height, robot.reference[joints], reach)
    search = _ContactSearch(request, data, scene, required, rng, tries)
    counts = np.zeros((len(scales), 2, 2), dtype=int)
    for done in range(1, samples + 1):
        root = _inside(space, sampler, rng)
        found = search.contacts_exist(root)
        for k, condition in enumerate(conditions):
            counts[k, int(condition.holds(root)), int(found)] += 1
        report(done)
    return [
        ScaleCounts(float(s), int(c[1, 1]), int(c[1, 0]), int(c[0, 1]), int(c[0, 0]))
        for s, c in zip(scales, counts, strict=True)
    ]


def _scaled(data: RobotData, scale: float) -> RobotData:
    """The data with the trunk volume at another scale."""
    return replace(data, trunk=tuple(trunk_volume(data.robot, scale)))


def _inside(space: RootSpace, sampler: RootSampler, rng: np.random.Generator) -> Array:
    """A random root configuration (7 + j,) within the bounds."""
    for _ in range(DRAWS // BATCH):
        for root in sampler.candidates(rng, BATCH):
            if space.contains(root):
                return np.asarray(root)
    bounds = [space.bounds.low.tolist(), space.bounds.high.tolist()]
    raise InvalidInput("request.bounds", bounds, "contain no root over the surfaces")


class _ContactSearch:
    """A search for a contact configuration at a root.

    A contact configuration is a whole-body configuration, free of collision, with all required
    limbs in contact and in static equilibrium. The search is incomplete: a configuration that it
    misses makes a false positive.
    """

    def __init__(
        self,
        request: PlanRequest,
        data: RobotData,
        scene: Scene,
        required: tuple[str, ...],
        rng: np.random.Generator,
        tries: int,
    ) -> None:
        options = request.options.generator
        self._generator = ContactGenerator(
            data, scene, request.gravity, 0.0, options, rng, request.grip_force
        )
        self._rng, self._tries = rng, tries
        self._limbs = [k for k, limb in enumerate(data.robot.limbs) if limb.name in required]
        self._others = [k for k in range(len(data.robot.limbs)) if k not in self._limbs]

    def contacts_exist(self, root: Array) -> bool:
        """True where a contact configuration was found.

        Args:
            root: (7 + j,) root configuration.
        """
        generator, robot = self._generator, self._generator.robot
        q = robot.reference.copy()
        q[robot.root_index] = root
        if not generator.body.collision.root_free(q):
            return False
        limbs = np.array(self._limbs, dtype=int)
        orders = [limbs, *(self._rng.permutation(limbs) for _ in range(self._tries - 1))]
        return any(self._contacts(q, root, order.tolist()) for order in orders)

    def _contacts(self, q: Array, root: Array, order: list[int]) -> bool:
        """True where contacts of the limbs, made in an order, and postures of the others exist."""
        generator, still = self._generator, LookAhead.still(root)
        contacts: list[Contact] = []
        for limb in order:
            minimum = generator.min_robustness if limb == order[-1] else -np.inf
            found = generator.generate(q, limb, contacts, still, min_robustness=minimum)
            if isinstance(found, Cause):
                return False
            q = found.q
            contacts.append(found.contact)
        for limb in self._others:
            rested = generator.rest(q, limb, self._rng)
            if rested is None:
                return False
            q = rested
        return bool(contacts)
