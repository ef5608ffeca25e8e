"""A contact planner that follows a guide with half the step, for gentler motions of the root."""

from __future__ import annotations

from dataclasses import replace

from rbprm_core.contacts.along_guide.planner import AlongGuidePlanner
from rbprm_core.contacts.protocol import ContactProblem


class ShortStepsPlanner(AlongGuidePlanner):
    """The along-guide planner with half the step of the request.

    Args:
        problem: problem to work on.
    """

    def __init__(self, problem: ContactProblem) -> None:
        sequence = problem.options.sequence
        step = max(0.5 * sequence.step, sequence.min_step)
        options = replace(problem.options, sequence=replace(sequence, step=step))
        super().__init__(replace(problem, options=options))
