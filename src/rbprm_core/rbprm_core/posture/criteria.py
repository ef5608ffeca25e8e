"""Criteria of posture problems: convex quadratic models in the tangent space."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from rbprm_core.arrays import Array
from rbprm_core.body.contact import Contact
from rbprm_core.body.stability import Stability
from rbprm_core.posture.coordinates import ROOT_DOF, Coordinates
from rbprm_core.posture.kinematics import Kinematics

ROOT_WEIGHT = 2.0
"""Weight of the root's coordinates in a distance of configurations, against one of the joints'."""


@dataclass(frozen=True, eq=False)
class Quadratic:
    """A quadratic model of a criterion at a configuration.

    Attributes:
        gradient: (k,) gradient with respect to the moving coordinates.
        hessian: (k, k) positive semidefinite model of the second derivative.
    """

    gradient: Array
    hessian: Array


class Criterion(Protocol):
    """A function of the configuration that a posture should minimise."""

    def model(self, kinematics: Kinematics, coordinates: Coordinates) -> Quadratic:
        """Its quadratic model at a configuration.

        Args:
            kinematics: the robot at the configuration.
            coordinates: the moving coordinates.
        """


@dataclass(frozen=True, eq=False)
class ReferencePosture:
    r"""Half the weighted squared distance $\|q \ominus q^*\|^2 / 2$ from a reference posture.

    Attributes:
        reference: (nq,) reference posture.
    """

    reference: Array

    def model(self, kinematics: Kinematics, coordinates: Coordinates) -> Quadratic:
        """See `Criterion.model`."""
        weights = np.ones(coordinates.size)
        weights[:ROOT_DOF] = ROOT_WEIGHT
        offset = coordinates.difference(self.reference, kinematics.q)
        return Quadratic(weights * offset, np.diag(weights))


@dataclass(frozen=True, eq=False)
class ReferencePath:
    r"""Half the squared distance from a path, $\min_s \|q \ominus q^*(s)\|^2 / 2$.

    Escande et al. 2013, equation 22. The nearest path parameter is taken among samples.

    Attributes:
        path: configuration (nq,) at a path parameter from 0 to 1.
        samples: number of samples of the path.
    """

    path: Callable[[float], Array]
    samples: int = 21

    def model(self, kinematics: Kinematics, coordinates: Coordinates) -> Quadratic:
        """See `Criterion.model`."""
        points = [self.path(float(s)) for s in np.linspace(0.0, 1.0, self.samples)]
        offsets = [coordinates.difference(point, kinematics.q) for point in points]
        nearest = int(np.argmin([offset @ offset for offset in offsets]))
        return ReferencePosture(points[nearest]).model(kinematics, coordinates)


@dataclass(frozen=True, eq=False)
class Robustness:
    """Negative robustness $-b_0$ on some contacts, newtons.

    Attributes:
        stability: robustness of the robot's contact sets.
        contacts: the contacts that carry the robot.
        damping: curvature, newtons per squared coordinate: b0 is piecewise linear, and steps along
            its gradient must be bounded.
    """

    stability: Stability
    contacts: tuple[Contact, ...]
    damping: float = 1e4

    def model(self, kinematics: Kinematics, coordinates: Coordinates) -> Quadratic:
        """See `Criterion.model`."""
        _, gradient = self.stability.b0_gradient(self.contacts, kinematics.com)
        rows = kinematics.com_jacobian[:, coordinates.moving]
        slope = np.nan_to_num(gradient) @ rows
        return Quadratic(-slope, self.damping * np.eye(coordinates.size))


@dataclass(frozen=True, eq=False)
class WeightedSum:
    """A sum of criteria.

    Attributes:
        parts: weight and criterion of each part.
    """

    parts: Sequence[tuple[float, Criterion]]

    def model(self, kinematics: Kinematics, coordinates: Coordinates) -> Quadratic:
        """See `Criterion.model`."""
        models = [(w, part.model(kinematics, coordinates)) for w, part in self.parts]
        return Quadratic(
            np.sum([w * model.gradient for w, model in models], axis=0),
            np.sum([w * model.hessian for w, model in models], axis=0),
        )
