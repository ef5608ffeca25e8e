"""Failures as data: a cause and its fields, from where they arise to where they leave the program.

Texts and remedies are made from them in `rbprm_core.failure_text`, and nowhere else.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum


class Cause(IntEnum):
    """Why something failed. The values are part of the interface: messages use them.

    Each block of twenty belongs to one stage, with room for causes to come.
    """

    UNSPECIFIED = 0

    # Placement of the root, 1 to 19
    TRUNK_IN_OBSTACLE = 1
    """The trunk volume is inside a closed obstacle."""
    TRUNK_COLLISION = 2
    """The trunk volume collides with the environment. Figure: scale."""
    NO_SURFACE_OF_KIND = 3
    """The environment has no surface of a kind that the limb may use. Fields: limb, kinds."""
    NO_SURFACE_IN_WORKSPACE = 4
    """No usable surface meets the limb's workspace. Fields: limb, kinds."""
    WEIGHT_UNSUPPORTED = 5
    """No contacts within the limbs' workspaces can support the weight."""

    # Whole-body state, 20 to 39
    ROOT_COLLISION = 20
    """The root part of the robot collides with the environment."""
    LIMB_COLLISION = 21
    """A limb collides. Field: limb."""
    REFERENCE_POSTURE_COLLISION = 22
    """A limb without contact collides in its reference posture. Field: limb."""
    LOW_ROBUSTNESS = 23
    """The contacts give too small a b0. Figures: robustness and threshold in newtons, contacts."""
    SURFACE_LOST = 24
    """No surface supports a contact. Fields: limb, surface; figures: x, y, z in metres."""
    BODY_COLLISION = 25
    """A collision body of a state collides with the environment. Fields: body, limb."""
    NO_START_LIMBS = 26
    """No limb is requested to be in contact."""

    CONTACT_NOT_REACHED = 27
    """A limb does not reach its contact in any posture found. Field: limb; figure: distance in
    metres, where an error of a radian counts as a metre."""
    SELF_COLLISION = 28
    """Two bodies of the robot collide. Fields: body (both names), limb."""
    TORQUE_LIMIT = 29
    """The contact forces need too large torques. Fields: body (name of the joint); figures: ratio
    and limit, shares of the joint's effort limit."""
    TASK_NOT_MET = 30
    """A task of the user is not met. Fields: body (name of the task); figure: violation."""

    # Contact of one limb, 40 to 59
    NO_CANDIDATE = 40
    """No sample of the limb is near a surface. Field: limb."""
    NO_KINEMATIC_SOLUTION = 41
    """Candidates exist, but none is reached without collision. Field: limb."""
    NO_EQUILIBRIUM = 42
    """Candidates are reached, but none gives equilibrium. Field: limb."""

    # Step along the guide, 60 to 79
    SECOND_CONTACT_OUT_OF_REACH = 60
    """A second contact leaves the workspace of its limb in one step. Field: limb."""
    SECOND_CONTACT_COLLISION = 61
    """A second contact is lost to a collision in one step. Field: limb."""
    NO_FREE_POSTURE = 62
    """A limb without contact has no posture free of collision. Field: limb."""

    # Guide path, 80 to 99
    TREES_NOT_CONNECTED = 80
    """The trees from start and goal do not meet. Figures: samples, start_nodes, goal_nodes."""
    ROADMAP_NOT_CONNECTED = 81
    """The roadmap does not connect start and goal. Figures: samples, nodes, parts."""
    NO_VALID_PATH = 82
    """None of the paths tried is valid; for planners without samples. Figure: tried."""

    # Replanning, 100 to 119
    EXECUTED_STATE_INVALID = 100
    """The state that the robot is in is invalid. Figure: state."""

    # Processes, 120 to 139
    PROCESS_DIED = 120
    """A planning process ended without an answer."""


CONTACT_CAUSES = (Cause.NO_CANDIDATE, Cause.NO_KINEMATIC_SOLUTION, Cause.NO_EQUILIBRIUM)
"""Why a single limb finds no contact."""


@dataclass(frozen=True)
class Failure:
    """Why something could not be done.

    Attributes:
        cause: the kind of failure; it decides which of the other fields are used.
        limb: name of the limb at fault; "" where no single limb is.
        surface: id of the surface concerned; "" where none is.
        body: name of the collision body concerned; "" where none is.
        kinds: kinds of surface that the limb may use.
        figures: names and values of the quantities concerned, in the order in which they were
            given; see `Cause` for names and units.
    """

    cause: Cause
    limb: str = ""
    surface: str = ""
    body: str = ""
    kinds: tuple[str, ...] = ()
    figures: tuple[tuple[str, float], ...] = ()

    @staticmethod
    def of(
        cause: Cause,
        limb: str = "",
        *,
        surface: str = "",
        body: str = "",
        kinds: tuple[str, ...] = (),
        **figures: float,
    ) -> Failure:
        """A failure with its figures given as keywords.

        Args:
            cause: the kind of failure.
            limb: name of the limb at fault.
            surface: id of the surface concerned.
            body: name of the collision body concerned.
            kinds: kinds of surface that the limb may use.
            **figures: quantities by name; see `Cause`.
        """
        return Failure(cause, limb, surface, body, kinds, tuple(figures.items()))

    def figure(self, name: str) -> float:
        """The value of a figure.

        Args:
            name: of the figure, as `Cause` documents it.

        Raises:
            KeyError: the failure has no such figure.
        """
        return dict(self.figures)[name]
