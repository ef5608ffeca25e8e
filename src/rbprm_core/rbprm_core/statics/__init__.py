"""Static equilibrium of a robot on its contacts: friction cones, robustness $b_0$, force closure.

The formulation is that of Tonneau et al. 2018, section 5.1.
"""

from rbprm_core.statics.cone import cone_generators
from rbprm_core.statics.equilibrium import Equilibrium, robustness, robustness_gradient
from rbprm_core.statics.grip import GRIP_FORCE, grip_robustness

__all__ = [
    "GRIP_FORCE",
    "Equilibrium",
    "cone_generators",
    "grip_robustness",
    "robustness",
    "robustness_gradient",
]
