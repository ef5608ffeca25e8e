"""Interface of the posture stage: its problem, and its generator.

A witness posture of a transition has the geometry of the larger contact set and is in equilibrium
on the smaller one (Escande et al. 2013, section 4.2).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

from rbprm_core.arrays import Array
from rbprm_core.body.contact import Contact
from rbprm_core.body.state import State
from rbprm_core.body.whole_body import WholeBody
from rbprm_core.budget import Budget
from rbprm_core.failures import Failure


@dataclass(frozen=True, eq=False)
class PostureProblem:
    """Input of a posture generator.

    Attributes:
        contacts: contacts whose geometry the posture has to satisfy.
        supporting: the contacts that carry the robot, a subset of `contacts`.
        min_robustness: raw b0 on the supporting contacts, newtons.
        reference: (nq,) configuration that the posture should be near.
    """

    contacts: tuple[Contact, ...]
    supporting: tuple[Contact, ...]
    min_robustness: float
    reference: Array


class PostureGenerator(Protocol):
    """A posture generator for one robot in one scene."""

    def solve(self, problem: PostureProblem, start: Array) -> State | Failure:
        """A posture that satisfies a problem, or why none was found.

        Args:
            problem: the problem.
            start: (nq,) configuration from which the search starts.
        """


@dataclass(frozen=True, eq=False)
class PostureSetting:
    """What a posture generator is made for.

    Attributes:
        body: whole-body queries of the robot in the scene.
        budget: time limit and cancel flag, polled often.
    """

    body: WholeBody
    budget: Budget = field(default_factory=Budget)


PostureGeneratorFactory = Callable[[PostureSetting], PostureGenerator]
"""Makes a posture generator for one robot in one scene."""
