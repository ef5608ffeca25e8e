"""Static equilibrium: friction cones and the robust linear program of section 5.1."""

from rbprm_core.statics.cone import cone_generators
from rbprm_core.statics.equilibrium import Equilibrium, robustness

__all__ = ["Equilibrium", "cone_generators", "robustness"]
