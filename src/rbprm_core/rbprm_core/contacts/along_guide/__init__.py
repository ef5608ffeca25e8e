"""P2: contact states along the guide (section 4, appendix B)."""

from rbprm_core.contacts.along_guide.generator import ContactGenerator
from rbprm_core.contacts.along_guide.options import SequenceOptions
from rbprm_core.contacts.along_guide.sequence import plan_sequence
from rbprm_core.contacts.along_guide.start import start_state

__all__ = [
    "ContactGenerator",
    "SequenceOptions",
    "plan_sequence",
    "start_state",
]
