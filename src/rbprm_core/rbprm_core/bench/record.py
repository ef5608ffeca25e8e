"""What is asked of a campaign, and what one run of it gives."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Case:
    """What is planned over the seeds.

    Attributes:
        scenario: a known name, or a scenario file.
        robot: a known name, or a robot file; None for the scenario's own.
        robustness: least raw b0 of every state, newtons; None for the scenario's own.
        time_limit: seconds; None for the scenario's own.
    """

    scenario: str
    robot: str | None = None
    robustness: float | None = None
    time_limit: float | None = None


@dataclass(frozen=True)
class Task:
    """One run, in so few bytes that it may be sent to another machine.

    Attributes:
        scenario, robot: as in `Case`, files by their absolute paths.
        seed: of everything random.
        robustness: newtons. time_limit: seconds.
        inputs: digest of what the scenario and the robot file say.
    """

    scenario: str
    robot: str | None
    seed: int
    robustness: float
    time_limit: float
    inputs: str = ""


@dataclass(frozen=True)
class RunFailure:
    """Why a run is no success. Runs with equal code, cause and limb failed in the same way.

    Attributes:
        code: name of an `ErrorCode`, or INVALID_PLAN or LATE of this module.
        cause: name of the `Cause`, with the stage where a time limit ended the run; kinds of the
            violations of an invalid plan; name of the field at fault, or of an unforeseen error.
        limb: name of the limb at fault, "" where no single limb is.
        text: the failure of this run in words, with its figures.
    """

    code: str
    cause: str
    limb: str
    text: str


INVALID_PLAN = "INVALID_PLAN"
"""A plan was found, but the check does not pass it."""
LATE = "LATE"
"""A valid plan was found, but after the time limit."""


@dataclass(frozen=True)
class RunRecord:
    """One run.

    Attributes:
        scenario, robot: their names. seed: of everything random.
        robustness: least raw b0 asked, newtons. time_limit: seconds.
        failure: None for a success: found within the limit, every bound of the check held, the
            goal's among them.
        seconds: by phase, as the planner counts them; "sequence.*" are operations inside it.
        wall, cpu: seconds that planning took by the clock, and of its thread on a processor.
        counts: the planner's.
        states, transitions: number of states and of contact changes; 0 where there is no plan.
        guide_length: metres.
        min_robustness: by the check, newtons; None where there is no plan or no forces hold it.
        violations: number by kind of bound; None where there is no plan.
        support: number of transitions in which the robot stands without the moving contact at both
            ends, at one, at neither; None where there is no plan.
        overhanging: number of contacts whose patch lies only in part on the environment.
        goal_missing: limbs that were to be in contact at the goal and are not.
        digest: of guide and states; equal plans have equal digests.
        inputs: as in `Task`: runs of other inputs are runs of another case.
        peak_memory: resident bytes at most, of the process that planned and checked.
        process: name of the machine and id of that process.
    """

    scenario: str
    robot: str
    seed: int
    robustness: float
    time_limit: float
    failure: RunFailure | None
    seconds: dict[str, float]
    wall: float
    cpu: float
    counts: dict[str, int]
    states: int = 0
    transitions: int = 0
    guide_length: float = 0.0
    min_robustness: float | None = None
    violations: dict[str, int] | None = None
    support: tuple[int, int, int] | None = None
    overhanging: int = 0
    goal_missing: tuple[str, ...] = ()
    digest: str = ""
    inputs: str = ""
    peak_memory: int = 0
    process: str = ""

    @property
    def success(self) -> bool:
        """Whether a valid plan was found in time."""
        return self.failure is None
