"""The stages of planning by name: for progress, time limits and statistics."""

from __future__ import annotations

from enum import StrEnum


class Stage(StrEnum):
    """A stage of the pipeline; the value is its name in statistics, progress and error texts."""

    WAITING = "waiting"
    """In a queue, before the work begins."""
    ROBOT_DATA = "robot data"
    """Workspaces and sample databases of the robot."""
    PREPARE = "prepare"
    """Validation of the request, and the models of robot and scene."""
    START = "start"
    """The first contact state."""
    GUIDE = "guide"
    """The guide path (P1)."""
    SHORTCUT = "shortcut"
    """Shortening and settling of the guide path."""
    CONTACTS = "sequence"
    """The contact sequence along the guide (P2)."""
    PORTFOLIO = "portfolio"
    """Several seeds in parallel processes."""
    PLANNING = "planning"
    """Any stage of a planning process that ended without a report."""


TIMED = (Stage.PREPARE, Stage.GUIDE, Stage.SHORTCUT, Stage.CONTACTS)
"""Stages whose seconds add up to the total time of a plan."""
