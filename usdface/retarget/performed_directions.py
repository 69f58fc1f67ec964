"""The performer's shapes: displacements of the markers, learned from a solved take.

Given weights, deviations from the shapes of the fit are a linear regression on its residuals. Their
prior: smooth over the face, and in proportion to how far the shape moves the skin around. Shapes
that the take hardly determines keep the fit's. The gain of a shape is not separable from its
weight and stays as it was. Errors common to all frames (the neutral's error) are left out.
"""

from dataclasses import dataclass

import numpy as np
from scipy.sparse.linalg import LinearOperator, cg

from usdface.arrays import BoolArray, FloatArray
from usdface.geometry.marker_spread import rms_radius
from usdface.retarget.rbf import distances

__all__ = ["PerformedDirections", "learn_directions"]

# Prior deviation of a marker's displacement, as a share of that of the skin around it. Of 0.07 and
# 0.15 the better one on the performers that the solve was built with.
_SPREAD = 0.07
# Reach of a deviation, in RMS radii of the markers: 2 cm on the ICT face. Set by hand.
_REACH = 0.3
# Least deviation for all shapes, as a share of that radius: 0.01 mm.
_FLOOR = 2e-4
# Misfit is correlated in time: this many frames count as one, as for places.
_REPEATED = 30.0
# A direction is known if its posterior deviation is below this share of the prior one.
_KNOWN = 0.5
# Least error of a marker, as a share of the radius: rounding.
_EXACT = 1e-7
# Of the conjugate gradients: errors far below the posterior's own.
_TOLERANCE, _STEPS = 1e-5, 1000


@dataclass(frozen=True, eq=False, slots=True)
class PerformedDirections:
    """Displacements of M markers by S shapes.

    Attributes
    ----------
    displacements : (S, M, 3) float64 [m]
    shares : (S,) float64
        Of each shape, its posterior deviation over the prior one: 1 = not observed.
    """

    displacements: FloatArray
    shares: FloatArray

    @property
    def known(self) -> BoolArray:
        """Whether a shape's directions were learned from the take: (S,) bool."""
        return np.asarray(self.shares < _KNOWN)


def learn_directions(
    expected: FloatArray,
    points: FloatArray,
    weights: FloatArray,
    residual: FloatArray,
    rigid: FloatArray,
    *,
    noise: float,
    misfit: float,
) -> PerformedDirections:
    """Return the most probable displacements of the markers by each shape.

    Parameters
    ----------
    expected : (S, M, 3) float64 [m]
        The prior mean.
    points : (M, 3) float64 [m]
        Resting markers.
    weights : (F, S) float64
        As solved.
    residual : (F, M, 3) float64 [m]
        The markers' displacements, less those expected; frames with an occluded marker (NaN) are
        left out.
    rigid : (3 M, K) float64
        Orthonormal small head motions, which are projected out.
    noise, misfit : float [m]
        Standard deviations of a marker coordinate.
    """
    count, markers = expected.shape[:2]
    whole = ~np.isnan(residual).any(axis=(1, 2))
    played, seen = weights[whole], residual[whole].reshape(-1, 3 * markers)
    if whole.any():
        played, seen = played - played.mean(axis=0), seen - seen.mean(axis=0)
    variance = noise**2 + _REPEATED * misfit**2
    size = rms_radius(points)
    variance = max(variance, (_EXACT * size) ** 2)
    gram, right = played.T @ played / variance, played.T @ seen / variance
    apart = np.exp(-((distances(points, points) / (_REACH * size)) ** 2) / 2.0)
    values, vectors = np.linalg.eigh(apart)
    smooth = vectors * np.sqrt(values.clip(min=0.0))
    moves = (expected**2).sum(axis=2) @ (apart / apart.sum(axis=1, keepdims=True)).T
    scale = (_SPREAD * np.sqrt(moves / 3.0) + _FLOOR * size)[..., None]

    def deviation(unit: FloatArray) -> FloatArray:
        return np.asarray(scale * np.einsum("mn,snd->smd", smooth, unit.reshape(expected.shape)))

    def back(values: FloatArray) -> FloatArray:
        of_shapes = scale * values.reshape(expected.shape)
        return np.asarray(np.einsum("mn,smd->snd", smooth, of_shapes).ravel())

    def without_head(values: FloatArray) -> FloatArray:
        return values - (values @ rigid) @ rigid.T

    def system(unit: FloatArray) -> FloatArray:
        predicted = gram @ without_head(deviation(unit).reshape(count, -1))
        return np.asarray(unit + back(predicted))

    operator = LinearOperator((expected.size,) * 2, matvec=system, dtype=np.float64)
    unit, _ = cg(operator, back(without_head(right)), rtol=_TOLERANCE, maxiter=_STEPS)
    # Each marker by itself, which overestimates the deviation.
    spread = scale[..., 0].T ** 2
    left = np.linalg.inv(gram + np.eye(count) / spread[:, :, None])
    open_ = np.diagonal(left, axis1=1, axis2=2).sum(axis=0) / spread.sum(axis=0)
    return PerformedDirections(
        _at_expected_gain(expected + deviation(unit), expected), np.sqrt(open_)
    )


def _at_expected_gain(displacements: FloatArray, expected: FloatArray) -> FloatArray:
    """Return displacements scaled to the expected ones' length along these."""
    along = (displacements * expected).sum(axis=(1, 2))
    before = (expected**2).sum(axis=(1, 2))
    factor = np.divide(before, along, out=np.ones(len(along)), where=along > 0.5 * before)
    return np.asarray(displacements * factor[:, None, None])
