"""Types of the contact sequence's messages for Cyclone DDS, equal to rbprm_msgs/msg/*.msg.

The classes have the fields of the .msg files in their order. On the wire a ROS type `pkg/msg/Name`
is called `pkg::msg::dds_::Name_`, and it is final: it has exactly these fields.
"""

from dataclasses import dataclass

from cyclonedds.idl import IdlStruct
from cyclonedds.idl.annotations import final
from cyclonedds.idl.types import float64, int32, sequence, uint8, uint32, uint64


@dataclass
@final
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32
    nanosec: uint32


@dataclass
@final
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    stamp: Time
    frame_id: str


@dataclass
@final
class Point(IdlStruct, typename="geometry_msgs::msg::dds_::Point_"):
    x: float64
    y: float64
    z: float64


@dataclass
@final
class Vector3(IdlStruct, typename="geometry_msgs::msg::dds_::Vector3_"):
    x: float64
    y: float64
    z: float64


@dataclass
@final
class Quaternion(IdlStruct, typename="geometry_msgs::msg::dds_::Quaternion_"):
    x: float64
    y: float64
    z: float64
    w: float64


@dataclass
@final
class Pose(IdlStruct, typename="geometry_msgs::msg::dds_::Pose_"):
    position: Point
    orientation: Quaternion


@dataclass
@final
class Contact(IdlStruct, typename="rbprm_msgs::msg::dds_::Contact_"):
    limb: str
    spot: str
    frame: str
    type: uint8
    pose: Pose
    frame_offset: Pose
    normal: Vector3
    points: sequence[Point]
    friction: float64
    surface_id: str


@dataclass
@final
class ContactState(IdlStruct, typename="rbprm_msgs::msg::dds_::ContactState_"):
    index: uint32
    root: Pose
    joint_positions: sequence[float64]
    com: Point
    robustness: float64
    contacts: sequence[Contact]


@dataclass
@final
class ContactSequence(IdlStruct, typename="rbprm_msgs::msg::dds_::ContactSequence_"):
    header: Header
    sequence_id: str
    revision: uint32
    first_changed_state: uint32
    robot: str
    urdf: str
    srdf: str
    joint_names: sequence[str]
    surfaces_stamp: Time
    start: Pose
    goal: Pose
    position_tolerance: float64
    orientation_tolerance: float64
    guide_planner: str
    contact_planner: str
    seed: uint64
    robustness_threshold: float64
    gravity: Vector3
    grip_force: float64
    goal_limbs: sequence[str]
    missing_goal_limbs: sequence[str]
    complete: bool
    states: sequence[ContactState]
