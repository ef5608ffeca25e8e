"""P2: contact states along the guide (section 4, appendix B)."""

from rbprm_core.contacts.generator import ContactGenerator
from rbprm_core.contacts.options import SequenceOptions
from rbprm_core.contacts.sequence import plan_sequence
from rbprm_core.contacts.start import start_state
from rbprm_core.contacts.state import Contact, State

__all__ = [
    "Contact",
    "ContactGenerator",
    "SequenceOptions",
    "State",
    "plan_sequence",
    "start_state",
]
