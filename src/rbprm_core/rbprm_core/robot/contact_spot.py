"""The contact spots of a robot: the parts of its bodies that can make contact."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from rbprm_core.arrays import Array
from rbprm_core.errors import InvalidInput
from rbprm_core.placement import Placement
from rbprm_core.robot.description import LimbDescription, PointContact


@dataclass(frozen=True, eq=False)
class ContactSpot:
    """A part of a body that can make contact: a ball, a part of a ball, or a rectangle.

    The contact frame is fixed to the body. Its origin is the ball's centre or the middle of the
    rectangle; its z axis points from the surface into the body.

    Attributes:
        name: name of the spot, unique in its limb.
        frame_name: name of the frame in the URDF that the spot is fixed to.
        frame: id of that frame in the robot's model.
        placement: placement of the contact frame in that frame.
        radius: radius of the ball, metres; 0 for a rectangle.
        half_size: (2,) half the sides of the rectangle along x and y, metres; None for a ball.
        min_cosine: smallest cosine of the angle between the contact frame's z axis and the normal
            of a surface in contact, for a part of a ball; -1 for a whole ball, and for a rectangle,
            which lies flat on its surface.
    """

    name: str
    frame_name: str
    frame: int
    placement: pin.SE3
    radius: float
    half_size: Array | None
    min_cosine: float

    @property
    def planar(self) -> bool:
        """True where the spot makes planar contacts."""
        return self.half_size is not None

    @property
    def corners(self) -> Array:
        """Points (k, 3) that carry forces, in the contact frame, metres.

        The origin for a ball (k = 1), the corners counter-clockwise for a rectangle (k = 4).
        """
        if self.half_size is None:
            return np.zeros((1, 3))
        x, y = self.half_size
        return np.array([[x, y, 0.0], [-x, y, 0.0], [-x, -y, 0.0], [x, -y, 0.0]])

    def center(self, position: Array, rotation: Array) -> Array:
        """Origin (3,) of the contact frame for a contact, in the frame of the contact, metres.

        The centre of a ball lies one radius from the contact point, along the surface's normal.

        Args:
            position: (3,) contact point, or middle of the rectangle, metres.
            rotation: (3, 3) frame of the contact, columns t1, t2 and the surface's outward normal.
        """
        return np.asarray(position + self.radius * rotation[:, 2])


def make_spot(model: pin.Model, description: LimbDescription) -> ContactSpot:
    """The contact spot of a limb's effector.

    Args:
        model: kinematic model of the robot.
        description: the limb's description.

    Raises:
        InvalidInput: an unknown frame, or a contact frame that cannot be used.
    """
    if not model.existFrame(description.effector):
        known = ", ".join(f.name for f in model.frames if f.type == pin.FrameType.BODY)
        field = f"limbs.{description.name}.effector"
        raise InvalidInput(field, description.effector, f"unknown frame; links: {known}")
    frame, placement = model.getFrameId(description.effector), _placement(description)
    contact = description.contact
    if isinstance(contact, PointContact):
        radius, half_size, min_cosine = contact.radius, None, float(np.cos(contact.angle))
    else:
        radius, half_size, min_cosine = 0.0, np.array(contact.half_size), -1.0
    return ContactSpot(
        name=description.effector,
        frame_name=description.effector,
        frame=frame,
        placement=placement,
        radius=radius,
        half_size=half_size,
        min_cosine=min_cosine,
    )


def _placement(description: LimbDescription) -> pin.SE3:
    """Placement of the contact frame in the effector frame."""
    field = f"limbs.{description.name}.contact"
    if isinstance(description.contact, PointContact):
        axis = np.array(description.contact.axis)
        if not axis.any():
            raise InvalidInput(f"{field}.axis", description.contact.axis, "must not be zero")
        turn = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), -axis).matrix()
        return pin.SE3(turn, np.array(description.contact.center))
    return Placement.parse(
        description.contact.position, description.contact.orientation, field
    ).transform
