"""Posture generators by name."""

from __future__ import annotations

from rbprm_core.posture.generator import SqpPostureGenerator
from rbprm_core.posture.protocol import PostureGeneratorFactory
from rbprm_core.registry import Registry

POSTURE_GENERATORS: Registry[PostureGeneratorFactory] = Registry(
    "posture generator", "rbprm.posture_generators", {"sqp": SqpPostureGenerator}
)
"""Factories of posture generators; entry points of "rbprm.posture_generators" add them."""
