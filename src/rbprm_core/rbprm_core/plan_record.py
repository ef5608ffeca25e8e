"""The contact plan and its file: all that is needed to use, show and check a plan.

SI units, radians, quaternions [x, y, z, w], right-handed, z up; every pose in the planning frame.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from rbprm_core.errors import InvalidInput
from rbprm_core.validation import Friction, parse_record

FORMAT: Literal["rbprm-contact-plan/1"] = "rbprm-contact-plan/1"

Vector3 = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]


class PlanRecord(BaseModel):
    """A frozen part of a plan; extra keys are kept, non-finite numbers refused."""

    model_config = ConfigDict(frozen=True, extra="allow", allow_inf_nan=False)


class Pose(PlanRecord):
    """Position in metres, orientation as unit quaternion [x, y, z, w]."""

    position: Vector3
    orientation: Quaternion


class RobotEntry(PlanRecord):
    """Which robot; paths are relative to the `share` folder of the package that ships them."""

    name: str
    urdf: str
    srdf: str | None = None
    joint_names: tuple[str, ...]


class MeshEntry(PlanRecord):
    """An environment mesh and its placement."""

    file: str
    translation: Vector3 = (0.0, 0.0, 0.0)
    rotation: tuple[Vector3, Vector3, Vector3] = ((1, 0, 0), (0, 1, 0), (0, 0, 1))
    friction: Friction = 0.5


class SurfaceEntry(PlanRecord):
    """A planar polygon, vertices counter-clockwise seen from outside, with holes."""

    id: str
    vertices: tuple[Vector3, ...]
    holes: tuple[tuple[Vector3, ...], ...] = ()
    friction: Friction = 0.5


class EnvironmentEntry(PlanRecord):
    """What the plan was made in."""

    name: str = ""
    meshes: tuple[MeshEntry, ...] = ()
    surfaces: tuple[SurfaceEntry, ...] = ()


class RequestEntry(PlanRecord):
    """What was asked; `robustness_threshold` is raw b0 in newtons, gravity in m/s^2.

    Where gravity is zero raw b0 is 0 or unbounded; b0 is then the one at which the coefficients
    add up to `grip_force`, newtons, and 0 where the contacts are not in force closure.

    `goal_limbs` are those that were to be in contact in the last state; None where any are good.
    """

    start: Pose
    goal: Pose
    seed: int = 0
    robustness_threshold: float = 0.0
    gravity: Vector3 = (0.0, 0.0, -9.81)
    grip_force: Annotated[float, Field(gt=0)] = 10.0
    goal_limbs: tuple[str, ...] | None = None
    position_tolerance: float = 1e-3
    orientation_tolerance: float = 1e-3


class ContactEntry(PlanRecord):
    """A contact of a limb; `frame_offset` is the contact frame in `frame` of the URDF."""

    limb: str
    frame: str
    frame_offset: Pose = Pose(position=(0, 0, 0), orientation=(0, 0, 0, 1))
    type: Literal["point", "planar"]
    position: Vector3
    orientation: Quaternion
    normal: Vector3
    points: tuple[Vector3, ...]
    friction: Friction
    surface: str = ""


class StateEntry(PlanRecord):
    """A whole-body contact configuration; `robustness` is raw b0 in newtons."""

    root: Pose
    joints: tuple[float, ...]
    com: Vector3
    robustness: float
    contacts: tuple[ContactEntry, ...]


class Statistics(PlanRecord):
    """Seconds per phase, counts, and the versions that made the plan."""

    time: dict[str, float] = {}
    counts: dict[str, int] = {}
    versions: dict[str, str] = {}


class ContactPlan(PlanRecord):
    """A whole plan, as it stands in the file."""

    format: Literal["rbprm-contact-plan/1"] = FORMAT
    robot: RobotEntry
    environment: EnvironmentEntry
    request: RequestEntry
    guide: tuple[Pose, ...]
    states: tuple[StateEntry, ...]
    statistics: Statistics = Statistics()

    def write(self, path: str | Path) -> None:
        """Write the plan file; the folder must exist."""
        try:
            Path(path).write_text(json.dumps(self.model_dump(mode="json"), indent=1) + "\n")
        except OSError as error:
            raise InvalidInput("out", str(path), f"cannot be written: {error.strerror}") from error

    @staticmethod
    def read(path: str | Path) -> ContactPlan:
        """Read a plan file.

        Raises:
            InvalidInput: absent, not JSON, or not a plan; names the first field at fault.
        """
        try:
            data: Any = json.loads(Path(path).read_text())
        except OSError as error:
            raise InvalidInput("plan", str(path), f"cannot be read: {error.strerror}") from error
        except (ValueError, RecursionError) as error:
            raise InvalidInput("plan", str(path), f"is not a JSON file: {error}") from error
        if not isinstance(data, dict) or data.get("format") != FORMAT:
            found = data.get("format") if isinstance(data, dict) else type(data).__name__
            raise InvalidInput("format", found, f'is not a plan file, whose format is "{FORMAT}"')
        return parse_record(ContactPlan, data)
