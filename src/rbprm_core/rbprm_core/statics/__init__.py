"""Static equilibrium: friction cones, the robust linear program of section 5.1, force closure."""

from rbprm_core.statics.cone import cone_generators
from rbprm_core.statics.equilibrium import Equilibrium, robustness
from rbprm_core.statics.grip import GRIP_FORCE, grip_robustness

__all__ = ["GRIP_FORCE", "Equilibrium", "cone_generators", "grip_robustness", "robustness"]
