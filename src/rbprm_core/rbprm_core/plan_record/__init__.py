"""The contact plan and its file: everything needed to use, show, check and repeat a plan.

SI units, radians, quaternions [x, y, z, w], right-handed, z up; every pose in the planning frame.
Imports nothing that plans: the check and the viewer read plans through this package alone.
"""

from rbprm_core.plan_record.contact_plan import FORMAT, FORMATS, ContactPlan
from rbprm_core.plan_record.records import (
    ClassificationEntry,
    ContactEntry,
    EnvironmentEntry,
    GuideNode,
    MeshEntry,
    PlanRecord,
    Pose,
    Quaternion,
    RobotEntry,
    StateEntry,
    Statistics,
    SurfaceEntry,
    TransitionEntry,
    Vector3,
)
from rbprm_core.plan_record.request_entry import (
    GRIP_FORCE,
    BoundsEntry,
    RequestEntry,
    RequestFields,
    StageNamesEntry,
)

__all__ = [
    "FORMAT",
    "FORMATS",
    "GRIP_FORCE",
    "BoundsEntry",
    "ClassificationEntry",
    "ContactEntry",
    "ContactPlan",
    "EnvironmentEntry",
    "GuideNode",
    "MeshEntry",
    "PlanRecord",
    "Pose",
    "Quaternion",
    "RequestEntry",
    "RequestFields",
    "RobotEntry",
    "StageNamesEntry",
    "StateEntry",
    "Statistics",
    "SurfaceEntry",
    "TransitionEntry",
    "Vector3",
]
