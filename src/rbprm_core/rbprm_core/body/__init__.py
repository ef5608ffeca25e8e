"""The robot's body under contact: contacts, states, collision and static equilibrium.

Below the guide planners and the contact planners, and used by both.
"""

from rbprm_core.body.collision import CollisionModel
from rbprm_core.body.contact import Contact
from rbprm_core.body.stability import Stability
from rbprm_core.body.state import State

__all__ = ["CollisionModel", "Contact", "Stability", "State"]
