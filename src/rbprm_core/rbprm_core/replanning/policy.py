"""Decision about a sequence under execution when the environment changes.

A pure function without clock or planning. If all states ahead are valid, the sequence is kept.
Otherwise it is replanned from the last valid state; where no plan is found from there, from earlier
ones, but never from before the state that the robot is in.
"""

from __future__ import annotations

from dataclasses import dataclass

from rbprm_core.errors import InvalidInput
from rbprm_core.failure_text import failure_text, root_remedy
from rbprm_core.failures import Cause, Failure


@dataclass(frozen=True)
class Situation:
    """A published sequence and the validity of its states.

    Attributes:
        states: number of states.
        executed: index of the state that the robot is in or moves to; -1 where it is unknown,
            which counts as the first.
        invalid: indices of the invalid states, in any order; states before the executed one do not
            count.
        complete: True where the sequence reaches its goal; False where it was cut after its last
            valid state, since replanning failed.
    """

    states: int
    executed: int = -1
    invalid: tuple[int, ...] = ()
    complete: bool = True


@dataclass(frozen=True)
class Keep:
    """The sequence is kept: nothing is planned."""


@dataclass(frozen=True)
class Replan:
    """The later part is to be replanned.

    Attributes:
        candidates: indices of states to replan from, the best first; the next one counts where
            planning from one fails.
    """

    candidates: tuple[int, ...]


@dataclass(frozen=True)
class Stuck:
    """Nothing can be planned from the state that the robot is in.

    Attributes:
        failure: why.
    """

    failure: Failure

    @property
    def reason(self) -> str:
        """The failure in words, and what to do."""
        return f"{failure_text(self.failure)}: {root_remedy(self.failure)}"


Decision = Keep | Replan | Stuck


def decide(situation: Situation) -> Decision:
    """The decision for a situation.

    Args:
        situation: the sequence and the validity of its states.

    Raises:
        InvalidInput: an index that no state has.
    """
    executed = _executed(situation)
    if situation.states == 0:
        return Keep()
    ahead = [i for i in situation.invalid if i >= executed]
    if executed in ahead:
        return Stuck(Failure.of(Cause.EXECUTED_STATE_INVALID, state=executed))
    if ahead:
        return Replan(_candidates(min(ahead) - 1, executed))
    if not situation.complete:
        return Replan(_candidates(situation.states - 1, executed))
    return Keep()


def _executed(situation: Situation) -> int:
    """Index of the executed state, 0 where it is unknown."""
    indices = [("invalid", index) for index in situation.invalid]
    if situation.executed != -1:
        indices.append(("executed", situation.executed))
    for field, index in indices:
        if not 0 <= index < situation.states:
            reason = f"must be the index of a state: there are {situation.states}"
            raise InvalidInput(field, index, reason)
    return max(situation.executed, 0)


def _candidates(last: int, executed: int) -> tuple[int, ...]:
    """The last state, then ever earlier ones that halve the way back to the executed one."""
    found = [last]
    while found[-1] > executed:
        found.append(executed + (found[-1] - executed) // 2)
    return tuple(found)
