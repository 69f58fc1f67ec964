"""What a solve adds to the sum of squares: how weights move, weighed by how far markers err."""

from dataclasses import dataclass, field

import numpy as np

from usdface.arrays import FloatArray, IntArray
from usdface.options import SolveOptions

__all__ = ["Regularisation"]

# How many markers err alike; 3 to 12 do well on performers with other movements than the rig's.
_ALIKE = 5.0


def _no_pairs() -> IntArray:
    return np.zeros((0, 2), np.int64)


@dataclass(frozen=True, eq=False, slots=True)
class Regularisation:
    """The terms beside the squares in the equation of `usdface.retarget.solve`.

    Each is what is expected of the weights times the error of the markers, so that noise and
    misfit, what was asked for and what was learned only mean something together. All terms are
    0 where markers do not err.

    Attributes
    ----------
    noise : float [m]
        Standard deviation of a marker coordinate.
    misfit : float [m]
        RMS error of a marker coordinate beyond the noise: what face and rig do not have in common.
    options : SolveOptions
    pairs : (P, 2) int64
        Left and right shapes that `options.symmetry` is about, see
        `usdface.face.symmetry.symmetric_pairs`.
    covariance : (S, S) float64 or None
        M of `usdface.retarget.covariance`, where it was learned from the take; it takes the place
        of `options.agility`, and of the ridge for noise, where frames are solved together.
    """

    noise: float
    misfit: float
    options: SolveOptions
    pairs: IntArray = field(default_factory=_no_pairs)
    covariance: FloatArray | None = None

    @property
    def lasting_variance(self) -> float:
        """The part of `variance` that does not average out over frames [m^2]."""
        return _ALIKE * self.misfit**2

    @property
    def variance(self) -> float:
        """The error variance e of a marker coordinate [m^2]."""
        return self.noise**2 + self.lasting_variance

    @property
    def ridge(self) -> float:
        """The factor of the squares of the weights [m^2]."""
        return self.variance / self.options.spread**2

    @property
    def lasting_ridge(self) -> float:
        """The part of `ridge` that does not average out over frames [m^2]."""
        return self.lasting_variance / self.options.spread**2

    @property
    def sparsity(self) -> float:
        """The factor of the sum of the weights [m^2]."""
        return self.variance * self.options.sparsity

    @property
    def symmetry(self) -> float:
        """The factor of the squared differences of left and right [m^2]."""
        return self.variance * self.options.symmetry

    @property
    def stiffness(self) -> float:
        """The factor of the integral of squared second derivatives [m^2 s^3]."""
        return self.noise**2 * self.options.smoothness / self.options.agility
