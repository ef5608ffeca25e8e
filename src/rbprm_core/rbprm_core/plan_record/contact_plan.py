"""The contact plan: its file, written in the newest version and read in all versions."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Literal

from rbprm_core.errors import InvalidInput
from rbprm_core.plan_record.records import (
    EnvironmentEntry,
    GuideNode,
    PlanRecord,
    RobotEntry,
    StateEntry,
    Statistics,
    TransitionEntry,
)
from rbprm_core.plan_record.request_entry import RequestEntry
from rbprm_core.validation import parse_record

FORMAT: Literal["rbprm-contact-plan/2"] = "rbprm-contact-plan/2"
FORMATS = ("rbprm-contact-plan/1", FORMAT)
"""Versions that can be read. Version 1 has no joints of guide nodes, no root frame, and of the
request only what a check needs."""


class ContactPlan(PlanRecord):
    """A whole plan.

    Attributes:
        format: name and version of the file format.
        robot: the robot.
        environment: the environment.
        request: the request that the plan answers.
        guide: nodes of the guide from start to goal.
        states: contact states from start to goal.
        transitions: transitions between neighbouring states, one fewer than these; empty in files
            of version 1.
        statistics: how the plan was made.
    """

    format: Literal["rbprm-contact-plan/1", "rbprm-contact-plan/2"] = FORMAT
    robot: RobotEntry
    environment: EnvironmentEntry
    request: RequestEntry
    guide: tuple[GuideNode, ...]
    states: tuple[StateEntry, ...]
    transitions: tuple[TransitionEntry, ...] = ()
    statistics: Statistics = Statistics()

    def write(self, path: str | Path) -> None:
        """Write the plan file.

        Args:
            path: file to write, in a folder that exists.

        Raises:
            InvalidInput: the file cannot be written.
        """
        try:
            Path(path).write_text(json.dumps(self.model_dump(mode="json"), indent=1) + "\n")
        except OSError as error:
            raise InvalidInput("out", str(path), f"cannot be written: {error.strerror}") from error

    @staticmethod
    def read(path: str | Path) -> ContactPlan:
        """The plan in a file of any version.

        Args:
            path: file to read.

        Raises:
            InvalidInput: absent, not JSON, or not a plan; names the first field at fault.
        """
        try:
            data: Any = json.loads(Path(path).read_text())
        except OSError as error:
            raise InvalidInput("plan", str(path), f"cannot be read: {error.strerror}") from error
        except (ValueError, RecursionError) as error:
            raise InvalidInput("plan", str(path), f"is not a JSON file: {error}") from error
        if not isinstance(data, dict) or data.get("format") not in FORMATS:
            found = data.get("format") if isinstance(data, dict) else type(data).__name__
            formats = " or ".join(f'"{name}"' for name in FORMATS)
            raise InvalidInput("format", found, f"is not a plan file, whose format is {formats}")
        return parse_record(ContactPlan, data)
