"""Regularisation of a solve: its terms, weighted by the error variance of the markers."""

from dataclasses import dataclass, replace

import numpy as np

from usdface.arrays import FloatArray
from usdface.options import SolveOptions
from usdface.retarget.solver.terms import TERMS, SolverTerm

__all__ = ["Regularisation", "lasting_variance"]

# Effective number of markers with equal errors. Of 1, 2 and 5 (weight RMS 0.140, 0.135, 0.134 in
# the mean of four performers with other movements than the rig's, python -m benchmarks.solve
# --quick; their motion is then 0.86, 0.80 and 0.70 as large as it should be) 2 is as accurate as 5
# and less muted.
_ALIKE = 2.0


@dataclass(frozen=True, eq=False, slots=True)
class Regularisation:
    """The terms beside the squares in the equation of `usdface.retarget.solver.solve`.

    Each is a prior of the weights times the error variance of the markers, so that noise, misfit,
    options and learned covariance belong together. All terms are 0 where that variance is 0.

    Attributes
    ----------
    noise : float [m]
        Standard deviation of a marker coordinate.
    misfit : float [m]
        RMS error of a marker coordinate beyond the noise: the difference of face and rig.
    options : SolveOptions
    names : tuple of str, length S
        The shapes, for terms by shape; () = unknown.
    covariance : (S, S) float64 or None
        M of `usdface.retarget.solver.covariance`, where it was learned from the take.
    size : float [m]
        RMS radius of the markers on the character.
    terms : tuple of SolverTerm
    """

    noise: float
    misfit: float
    options: SolveOptions
    names: tuple[str, ...] = ()
    covariance: FloatArray | None = None
    size: float = 0.0
    terms: tuple[SolverTerm, ...] = TERMS

    @property
    def lasting_variance(self) -> float:
        """The part of `variance` that does not average out over frames [m^2]."""
        return lasting_variance(self.misfit)

    @property
    def variance(self) -> float:
        """The error variance e of a marker coordinate [m^2]."""
        return self.noise**2 + self.lasting_variance

    def unlearned(self) -> "Regularisation":
        """Return the same without the covariance learned from the take."""
        return replace(self, covariance=None)

    def added_to(self, normal: FloatArray) -> FloatArray:
        """Return a normal matrix (S, S) [m^2] with those of all terms."""
        for term in self.terms:
            matrix = term.matrix(self, len(normal))
            if matrix is not None:
                normal = normal + matrix
        return normal

    def pulled(self, right: FloatArray) -> FloatArray:
        """Return right-hand sides (F, S) [m^2] with those of all terms."""
        for term in self.terms:
            pull = term.pull(self, right.shape[1])
            if pull is not None:
                right = right + pull
        return right

    def bands(self, times: FloatArray) -> FloatArray:
        """Return K of all terms for frames at `times` (F,) [s]: (3, F) [m^2], upper bands."""
        parts = (term.bands(self, times) for term in self.terms)
        return sum((part for part in parts if part is not None), np.zeros((3, len(times))))

    def value(self, weights: FloatArray) -> FloatArray:
        """Return the cost of weights (F, S) in each frame, without the bands: (F,) [m^2]."""
        values = (term.value(self, weights) for term in self.terms)
        return sum(values, np.zeros(len(weights)))

    def gradient(self, weights: FloatArray) -> FloatArray:
        """Return the gradient of `value`: (F, S) [m^2]."""
        matrix = self.added_to(np.zeros((weights.shape[1],) * 2))
        return np.asarray(weights @ matrix - self.pulled(np.zeros((1, weights.shape[1]))))

    def precision(self, size: int) -> FloatArray:
        """Return the inverse covariance that is expected of a frame's weights: (S, S) [1].

        Before the take is seen; the noise or the misfit must be above 0.
        """
        return self.unlearned().added_to(np.zeros((size, size))) / self.variance

    def spectrum(self, frequencies: FloatArray, step: float) -> FloatArray:
        """Return the eigenvalues of the bands far from both ends of a take: (N,) [m^2].

        Parameters
        ----------
        frequencies : (N,) float64 [rad]
            Per frame.
        step : float [s]
            Between frames; 0 = a single frame, which nothing joins.
        """
        if step <= 0.0:
            return np.zeros(len(frequencies))
        two, one, none = self.bands(step * np.arange(9.0))
        curve = none[4] + 2.0 * (one[5] * np.cos(frequencies) + two[6] * np.cos(2.0 * frequencies))
        return np.asarray(curve.clip(min=0.0))


def lasting_variance(misfit: float) -> float:
    """Return the part of the error variance that does not average out over frames [m^2].

    `misfit` [m] is the RMS error of a marker coordinate beyond the noise.
    """
    return _ALIKE * misfit**2
