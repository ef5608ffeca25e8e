"""Contact planners by name: those of this package, and those of other packages."""

from __future__ import annotations

from rbprm_core.contacts.along_guide.planner import AlongGuidePlanner
from rbprm_core.contacts.protocol import ContactPlannerFactory
from rbprm_core.registry import Registry

CONTACT_PLANNERS: Registry[ContactPlannerFactory] = Registry(
    "contact planner", "rbprm.contact_planners", {"along_guide": AlongGuidePlanner}
)
"""Factories of contact planners; an entry point of the group "rbprm.contact_planners" adds one."""
