"""The request for a plan: start, goal, conditions and options; validated here and nowhere else.

Scenario files, plan files and messages make a `PlanRequest` of their own words and call
`PlanRequest.validated`; a table of names turns the field at fault into their words again, see
`rbprm_core.validation.naming_fields`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from rbprm_core.contacts.along_guide.options import GeneratorOptions, SequenceOptions
from rbprm_core.contacts.registry import CONTACT_PLANNERS
from rbprm_core.errors import InvalidInput
from rbprm_core.guide.guide_options import GuideOptions
from rbprm_core.guide.registry import GUIDE_PLANNERS
from rbprm_core.guide.root_space import RootBounds
from rbprm_core.placement import Placement
from rbprm_core.plan_record import BoundsEntry, Pose, RequestEntry, RequestFields
from rbprm_core.robot import Robot
from rbprm_core.statics import GRIP_FORCE
from rbprm_core.validation import MAX_COUNT, Record, one_of, parse_record

Array = NDArray[np.float64]

GRAVITY = np.array([0.0, 0.0, -9.81])
"""Gravity (3,) on level ground, m/s^2."""

END_TOLERANCE = 1e-3
"""Tolerance of the root at start and goal where it may not leave the guide
(`SequenceOptions.root_slack`): distance in metres, and angle in radians."""


def limb_names(robot: Robot, names: Sequence[str], field: str) -> tuple[str, ...]:
    """Names of limbs of a robot, each once.

    Args:
        robot: the robot.
        names: names of limbs.
        field: field that holds the names, for the error.

    Raises:
        InvalidInput: an unknown name, or one twice.
    """
    return _known_limbs(names, [limb.name for limb in robot.limbs], field)


@dataclass(frozen=True)
class StageNames:
    """Which implementation does the work of each stage, by name.

    Attributes:
        guide: name of the guide planner: rrt, prm (whose roadmap can be kept from one request to
            the next), or that of a plug-in.
        contacts: name of the contact planner: along_guide, or that of a plug-in.
    """

    guide: str = "rrt"
    contacts: str = "along_guide"


@dataclass(frozen=True)
class PlannerOptions:
    """Every option of the planner; the defaults serve the scenarios of Tonneau et al. 2018.

    Attributes:
        guide: options of the guide planners.
        guides: maximum number of guides tried; mostly the time limit comes first.
        generator: options of the generator of contacts.
        sequence: options of the contact sequence.
    """

    guide: GuideOptions = field(default_factory=GuideOptions)
    guides: Annotated[int, Field(ge=1, le=MAX_COUNT)] = 1000
    generator: GeneratorOptions = field(default_factory=GeneratorOptions)
    sequence: SequenceOptions = field(default_factory=SequenceOptions)


@dataclass(frozen=True, eq=False)
class PlanRequest:
    """Start, goal and conditions of a plan.

    Attributes:
        start: placement of the root at the start, in the planning frame.
        goal: placement of the root at the goal, in the planning frame.
        bounds: bounds of the root along the whole guide.
        required_limbs: names of the limbs whose workspace must meet a surface all along the guide.
        start_limbs: names of the limbs in contact at the start, in the order in which the contacts
            are made.
        robustness_threshold: minimum raw b0 of every state, newtons.
        seed: seed of the random generator, not negative.
        gravity: (3,) gravity in the planning frame, m/s^2. Where it is zero every state is in force
            closure, and b0 is that of `rbprm_core.statics.grip`.
        grip_force: sum of the contact forces by which b0 is measured without gravity, newtons.
        goal_limbs: names of the limbs that are to be in contact in the last state; None where any
            limbs will do.
        options: options of the planner.
        stages: implementations by stage.
        time_limit: longest planning time, seconds, as it is kept in the plan; None where none is.
            The planner itself obeys its `Budget`, which the caller makes.
    """

    start: Placement
    goal: Placement
    bounds: RootBounds
    required_limbs: tuple[str, ...]
    start_limbs: tuple[str, ...]
    robustness_threshold: float
    seed: int = 0
    gravity: Array = field(default_factory=lambda: GRAVITY.copy())
    grip_force: float = GRIP_FORCE
    goal_limbs: tuple[str, ...] | None = None
    options: PlannerOptions = field(default_factory=PlannerOptions)
    stages: StageNames = field(default_factory=StageNames)
    time_limit: float | None = None

    @property
    def min_robustness(self) -> float:
        """Minimum raw b0 of a state of the plan, newtons; see `accept_below_threshold`."""
        return 0.0 if self.options.generator.accept_below_threshold else self.robustness_threshold

    def validated(self, limbs: Sequence[str]) -> PlanRequest:
        """The same request with every value checked, and with arrays and tuples where they belong.

        This is the one validation of a request: the planner calls it before it plans, and whatever
        makes requests from files or messages calls it to learn of the field at fault.

        Args:
            limbs: names of the robot's limbs.

        Raises:
            InvalidInput: names the first field at fault by its dotted name: `start.position`,
                `bounds.x` (of y, z, yaw, pitch, roll likewise), `required_limbs.2`,
                `options.sequence.step`, `stages.guide`, ...
        """
        for name in ("start", "goal"):
            place = getattr(self, name)
            Placement.parse(place.position, place.orientation, name)
        for name in ("low", "high", "half_ranges"):
            value = getattr(self.bounds, name)
            if np.shape(value) != (3,):
                raise InvalidInput(f"bounds.{name}", value, "must be an array of 3 numbers")
        parse_record(_Checked, self._plain())
        for axis, low, high in zip("xyz", self.bounds.low, self.bounds.high, strict=True):
            if low > high:
                reason = f"is empty: the lower bound {low:g} is over the upper bound {high:g}"
                raise InvalidInput(f"bounds.{axis}", [float(low), float(high)], reason)
        if self.seed < 0:
            raise InvalidInput("seed", self.seed, "must not be negative")
        check_options(self.options, "options.")
        check_stages(self.stages, "stages.")
        return replace(
            self,
            required_limbs=_known_limbs(self.required_limbs, limbs, "required_limbs"),
            start_limbs=_known_limbs(self.start_limbs, limbs, "start_limbs"),
            goal_limbs=(
                None
                if self.goal_limbs is None
                else _known_limbs(self.goal_limbs, limbs, "goal_limbs")
            ),
            robustness_threshold=float(self.robustness_threshold),
            gravity=np.array(self.gravity, dtype=float),
            grip_force=float(self.grip_force),
        )

    @staticmethod
    def from_fields(
        fields: RequestFields,
        limbs: Sequence[str],
        *,
        seed: int = 0,
        options: PlannerOptions | None = None,
        stages: StageNames | None = None,
    ) -> PlanRequest:
        """The validated request of a scenario or plan file.

        Args:
            fields: request as the file holds it.
            limbs: names of the robot's limbs, all of which are meant where the file names none.
            seed: seed of the random generator.
            options: options of the planner; the defaults where None.
            stages: implementations by stage; the defaults where None.

        Raises:
            InvalidInput: see `validated`; `bounds` where the file has none.
        """
        if fields.bounds is None:
            raise InvalidInput("bounds", None, "is missing")
        required, start = fields.required_limbs, fields.start_limbs
        return PlanRequest(
            start=_placement(fields.start, "start"),
            goal=_placement(fields.goal, "goal"),
            bounds=_bounds(fields.bounds),
            required_limbs=tuple(limbs) if required is None else required,
            start_limbs=tuple(limbs) if start is None else start,
            robustness_threshold=fields.robustness_threshold,
            seed=seed,
            gravity=np.array(fields.gravity),
            grip_force=fields.grip_force,
            goal_limbs=fields.goal_limbs,
            options=PlannerOptions() if options is None else options,
            stages=StageNames() if stages is None else stages,
            time_limit=fields.time_limit,
        ).validated(limbs)

    def entry(self) -> RequestEntry:
        """The whole request as a plan file holds it."""
        return RequestEntry(
            **self._plain(),
            position_tolerance=END_TOLERANCE + self.options.sequence.root_slack,
            orientation_tolerance=END_TOLERANCE,
        )

    def _plain(self) -> dict[str, Any]:
        """The request in the words of `RequestEntry`, as plain numbers, lists and tables."""
        bounds = self.bounds
        yaw, pitch, roll = bounds.half_ranges.tolist()
        x, y, z = np.column_stack([bounds.low, bounds.high]).tolist()
        return {
            "start": _pose(self.start),
            "goal": _pose(self.goal),
            "bounds": {"x": x, "y": y, "z": z, "yaw": yaw, "pitch": pitch, "roll": roll},
            "required_limbs": self.required_limbs,
            "start_limbs": self.start_limbs,
            "goal_limbs": self.goal_limbs,
            "robustness_threshold": self.robustness_threshold,
            "gravity": np.asarray(self.gravity).tolist(),
            "grip_force": self.grip_force,
            "time_limit": self.time_limit,
            "seed": np.asarray(self.seed).tolist(),
            "stages": asdict(self.stages),
            "options": asdict(self.options),
        }


class _Checked(RequestFields, extra="forbid"):
    """Types and ranges of a whole request."""

    seed: int
    stages: StageNames
    options: PlannerOptions


class _Options(Record):
    """Options in a table of their own, so that errors name them after it."""

    options: PlannerOptions = PlannerOptions()


def read_options(data: Mapping[str, Any]) -> PlannerOptions:
    """The options of the planner from nested tables.

    Args:
        data: options by name, nested by stage.

    Raises:
        InvalidInput: an unknown option, a value out of its range, or options that contradict each
            other; names the field after `options.`.
    """
    options = parse_record(_Options, {"options": data}).options
    check_options(options, "options.")
    return options


def check_options(options: PlannerOptions, prefix: str = "") -> None:
    """Raise where options contradict each other.

    Args:
        options: options, each in its own range.
        prefix: words before an option's name in the error, such as "options.".

    Raises:
        InvalidInput: names one of the options as the field and the other in the text.
    """
    sequence = options.sequence
    if sequence.min_step > sequence.step:
        reason = f"contradicts {prefix}sequence.step = {sequence.step:g}: it must not be larger"
        raise InvalidInput(f"{prefix}sequence.min_step", sequence.min_step, reason)


def check_stages(stages: StageNames, prefix: str = "") -> None:
    """Raise where no implementation has the name given for a stage.

    Args:
        stages: implementations by stage.
        prefix: words before the stage in the error, such as "stages.".

    Raises:
        InvalidInput: an unknown name, or a plug-in that cannot be loaded.
    """
    GUIDE_PLANNERS.get(stages.guide, f"{prefix}guide")
    CONTACT_PLANNERS.get(stages.contacts, f"{prefix}contacts")


def _known_limbs(names: Sequence[str], known: Sequence[str], field: str) -> tuple[str, ...]:
    """Names of limbs, each known and named once."""
    for i, name in enumerate(names):
        one_of(f"{field}.{i}", name, known)
        if name in names[:i]:
            raise InvalidInput(f"{field}.{i}", name, "is named twice")
    return tuple(names)


def _placement(pose: Pose, field: str) -> Placement:
    return Placement.parse(pose.position, pose.orientation, field)


def _pose(placement: Placement) -> dict[str, list[float]]:
    return {
        "position": placement.position.tolist(),
        "orientation": placement.orientation.tolist(),
    }


def _bounds(entry: BoundsEntry) -> RootBounds:
    box = np.array([entry.x, entry.y, entry.z])
    return RootBounds(box[:, 0], box[:, 1], np.array([entry.yaw, entry.pitch, entry.roll]))
