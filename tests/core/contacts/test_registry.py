"""Contact planners by name."""

from __future__ import annotations

import pytest

from rbprm_core.contacts.along_guide.planner import AlongGuidePlanner
from rbprm_core.contacts.registry import CONTACT_PLANNERS
from rbprm_core.errors import InvalidInput


def test_the_built_in_planner() -> None:
    assert CONTACT_PLANNERS.names()[0] == "along_guide"
    assert CONTACT_PLANNERS.get("along_guide", "stages.contacts") is AlongGuidePlanner
    assert CONTACT_PLANNERS.plugin("along_guide") is None
    assert CONTACT_PLANNERS.versions(["along_guide"]) == {}


def test_an_unknown_name_is_bad_input() -> None:
    with pytest.raises(InvalidInput, match="unknown contact planner; known: along_guide") as caught:
        CONTACT_PLANNERS.get("levitation", "stages.contacts")
    assert (caught.value.field, caught.value.value) == ("stages.contacts", "levitation")
