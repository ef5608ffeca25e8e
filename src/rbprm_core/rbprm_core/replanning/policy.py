"""What to do about a sequence that is being executed when its surroundings change.

Pure: no clock, no planning. If nothing that lies ahead is touched, the plan stands. Otherwise it is
planned anew from the last state that holds; where that leads nowhere, from earlier ones, but never
from before the state that the robot is in.
"""

from __future__ import annotations

from dataclasses import dataclass

from rbprm_core.errors import InvalidInput


@dataclass(frozen=True)
class Situation:
    """A published sequence and how it stands.

    Attributes:
        states: number of states.
        executed: index of the state that the robot is in or moves to; -1 where nobody said, which
            counts as the first.
        invalid: indices of the states that do not hold, in any order; those that are over do not
            count.
        complete: True where the sequence reaches its goal; False for the part that holds of one
            whose replanning failed.
    """

    states: int
    executed: int = -1
    invalid: tuple[int, ...] = ()
    complete: bool = True


@dataclass(frozen=True)
class Keep:
    """The sequence stands: nothing is planned."""


@dataclass(frozen=True)
class Replan:
    """The later part is to be planned anew.

    Attributes:
        candidates: indices of states to go on from, the best first; the next one where planning
            from one finds no way.
    """

    candidates: tuple[int, ...]


@dataclass(frozen=True)
class Stuck:
    """Nothing can be planned from where the robot is.

    Attributes:
        reason: why, for people.
    """

    reason: str


Decision = Keep | Replan | Stuck


def decide(situation: Situation) -> Decision:
    """What to do.

    Raises:
        InvalidInput: an index that no state has.
    """
    executed = _executed(situation)
    if situation.states == 0:
        return Keep()
    ahead = [i for i in situation.invalid if i >= executed]
    if executed in ahead:
        return Stuck(
            f"state {executed}, which the robot is in, does not hold: plan from a measured state"
        )
    if ahead:
        return Replan(_candidates(min(ahead) - 1, executed))
    if not situation.complete:
        return Replan(_candidates(situation.states - 1, executed))
    return Keep()


def _executed(situation: Situation) -> int:
    """Index of the executed state, 0 where nobody said."""
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
