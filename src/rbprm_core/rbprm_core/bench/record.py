"""Records of a campaign: cases, tasks and runs."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Case:
    """A scenario to be planned with several seeds.

    Attributes:
        scenario: a known name, or a scenario file.
        robot: a known name, or a robot file; None for the scenario's own.
        robustness: raw b0 that every state must reach, newtons; None for the scenario's own.
        time_limit: time limit of a run, seconds; None for the scenario's own.
    """

    scenario: str
    robot: str | None = None
    robustness: float | None = None
    time_limit: float | None = None


@dataclass(frozen=True)
class Task:
    """One run to be done, small enough to be sent to another machine.

    Attributes:
        scenario: scenario as in `Case`, a file by its absolute path.
        robot: robot as in `Case`, a file by its absolute path.
        seed: seed of the random generator.
        robustness: raw b0 that every state must reach, newtons.
        time_limit: time limit, seconds.
        inputs: digest of the contents of the scenario file and the robot file.
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
    """Result of one run.

    Attributes:
        scenario: name of the scenario.
        robot: name of the robot.
        seed: seed of the random generator.
        robustness: raw b0 that every state had to reach, newtons.
        time_limit: time limit, seconds.
        failure: why the run is no success; None where a plan was found within the time limit that
            passes the check, the requested goal included.
        seconds: seconds by stage, as the planner counts them; "sequence.*" are operations of the
            stage "sequence".
        wall: seconds of planning by the clock.
        cpu: seconds of processor time of the planning thread.
        counts: counts of the planner by name.
        states: number of states; 0 without a plan.
        transitions: number of contact transitions; 0 without a plan.
        guide_length: length of the guide, metres.
        min_robustness: smallest b0 of all states by the check, newtons; None without a plan, or
            where no forces hold a state.
        violations: number of violations by kind; None without a plan.
        support: number of transitions in which the robot is in equilibrium without the moving
            contact at both ends, at one, at neither; None without a plan.
        overhanging: number of contacts whose patch lies only in part on the environment.
        goal_missing: names of the limbs requested in contact at the goal that are not.
        digest: digest of guide and states; equal plans have equal digests.
        inputs: digest as in `Task`; runs with other inputs belong to another case.
        peak_memory: largest resident memory of the process that planned and checked, bytes.
        process: name of the machine and id of the process.
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
