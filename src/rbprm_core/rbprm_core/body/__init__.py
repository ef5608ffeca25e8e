"""The robot's body under contact: contacts, states, transitions, whole-body queries.

Below the guide planners and the contact planners, and used by both.
"""

from rbprm_core.body.collision import CollisionModel
from rbprm_core.body.contact import Contact
from rbprm_core.body.stability import Stability
from rbprm_core.body.state import State
from rbprm_core.body.transition import Action, ContactChange, Transition
from rbprm_core.body.whole_body import WholeBody

__all__ = [
    "Action",
    "CollisionModel",
    "Contact",
    "ContactChange",
    "Stability",
    "State",
    "Transition",
    "WholeBody",
]
