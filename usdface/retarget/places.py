"""The true places of the performer's markers on the skin.

A marker is bound to a vertex by eye, some millimetres from its true place. There are two sources of
evidence. In the neutral, performer and character differ by a field that is smooth over the face,
and a marker that deviates from its neighbours' field is beside its vertex. In motion a marker moves
as the skin at its true place. Both are Gaussian estimates with a known spread, and are combined as
such.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from usdface.arrays import FloatArray
from usdface.blend_shapes.evaluator import BlendShapeEvaluator
from usdface.blend_shapes.vertex_evaluator import evaluator_of
from usdface.face.marker_surface import MarkerSurface, PlacedMarkers
from usdface.geometry.marker_spread import rms_radius
from usdface.geometry.rigid_fit import similarity_fit
from usdface.geometry.rigid_modes import small_motions
from usdface.retarget.motion_errors import MotionErrors
from usdface.retarget.rbf import distances

__all__ = [
    "MOST_MARKERS",
    "PlaceGuess",
    "guess_at_rest",
    "guess_in_image",
    "guess_in_motion",
    "search_in_motion",
]

# More points than this are a mesh, not markers: the time grows with their cube.
MOST_MARKERS = 200
# Reach of the field between two faces, in RMS radii of the markers, and its variance by that of a
# place: the grid that is searched for the most likely pair. 0.3 to 1.2 radii are 2 to 7 cm.
_REACHES = (0.33, 0.5, 0.75, 1.2)
_RATIOS = 10.0 ** np.arange(-2.0, 4.1, 0.25)
# Scale and head motion are free: their variance by that of a place. Any large number.
_FREE = 1e6
# Frames sampled for the search of a place: a bound on time.
_SEARCHED = 300
# Least variance of weights, for those that never move in the take.
_STILL = 1e-6
# Markers are on their vertices if they err by less than this share of the face's size at rest.
_EXACT = 1e-6
# Keeps a covariance invertible: of a place's variance. Motions smaller than this share of the
# largest are none.
_ROUNDING = 1e-6


@dataclass(frozen=True, eq=False, slots=True)
class PlaceGuess:
    """A distribution of the shifts of M places from their vertices.

    Attributes
    ----------
    mean : (M, 3) float64 [m]
    covariance : (3 M, 3 M) float64 [m^2]
    spread : float [m]
        Standard deviation of a shift along an axis, before anything is known.
    """

    mean: FloatArray
    covariance: FloatArray
    spread: float

    def on_vertices(self, surface: MarkerSurface) -> bool:
        """Return whether markers sit on the vertices of a surface: all that is left is rounding."""
        return self.spread <= _EXACT * surface.reach

    def centred(self) -> "PlaceGuess":
        """Return the guess that markers sit on their vertices, with the same spread."""
        return PlaceGuess(
            np.zeros_like(self.mean), self.spread**2 * np.eye(self.mean.size), self.spread
        )

    def precision(self, ways: FloatArray) -> FloatArray:
        """Return the inverse covariance of shifts along orthonormal `ways` (3 M, K): (K, K)."""
        along = ways.T @ self.covariance @ ways
        return np.asarray(np.linalg.inv(along + _ROUNDING * self.spread**2 * np.eye(len(along))))

    def improbability(self, marker: int, shifts: FloatArray) -> FloatArray:
        """Return the squared distances of shifts (N, 3) of one marker from the mean: (N,).

        In deviations (Mahalanobis).
        """
        own = self.covariance.reshape(len(self.mean), 3, -1, 3)[marker, :, marker]
        own = own + _ROUNDING * self.spread**2 * np.eye(3)
        off = shifts - self.mean[marker]
        return np.asarray(np.einsum("ni,ni->n", off, np.linalg.solve(own, off.T).T))


def guess_at_rest(neutral: FloatArray, points: FloatArray) -> PlaceGuess:
    """Guess places from the resting markers.

    After the best similarity, ``neutral - points`` is a smooth field plus each marker's shift: a
    Gaussian process plus independent errors, whose reach and variances are the most likely ones
    (restricted likelihood, scale and head motion left out).

    Parameters
    ----------
    neutral : (M, 3) float64
        The performer's markers.
    points : (M, 3) float64 [m]
        The vertices that they are bound to.
    """
    linear, offset = similarity_fit(neutral, points)
    error = (neutral @ linear + offset - points).ravel()
    centred = points - points.mean(axis=0)
    fixed = np.concatenate(
        [small_motions(points, image=False).reshape(6, -1), centred.ravel()[None]]
    )
    return _guess(error, points, fixed)


def guess_in_image(neutral: FloatArray, points: FloatArray) -> PlaceGuess:
    """Return `guess_at_rest` of markers in an image, centred: the image shows no depth.

    Parameters
    ----------
    neutral : (M, 2) float64 [m]
        The performer's markers, aligned with the character.
    points : (M, 3) float64 [m]
        The vertices that they are bound to.
    """
    fixed = small_motions(points, image=True)[..., :2].reshape(6, -1)
    spread = _guess((neutral - points[:, :2]).ravel(), points, fixed).spread
    count = 3 * len(points)
    return PlaceGuess(np.zeros((len(points), 3)), spread**2 * np.eye(count), spread)


def _guess(error: FloatArray, points: FloatArray, fixed: FloatArray) -> PlaceGuess:
    """Return the distribution of shifts by errors (M D,), without the motions `fixed` (K, M D)."""
    count, axes = len(points), len(error) // len(points)
    _, size, ways = np.linalg.svd(fixed)
    rank = int((size > _ROUNDING * size[0]).sum())  # less than K: a plane that turns in an image
    unit, free = ways[:rank], ways[rank:].T
    apart = (distances(points, points) / rms_radius(points)) ** 2
    seen = free.T @ error
    best, chosen = -np.inf, (np.zeros((count, count)), 0.0)
    for reach in _REACHES:
        field = np.kron(np.exp(-apart / (2.0 * reach**2)), np.eye(axes))
        values, vectors = np.linalg.eigh(free.T @ field @ free)
        along = (vectors.T @ seen) ** 2
        scale = np.outer(_RATIOS, values.clip(min=0.0)) + 1.0
        variance = (along / scale).mean(axis=1)
        likelihood = -0.5 * (len(seen) * np.log(variance + 1e-300) + np.log(scale).sum(axis=1))
        place = int(likelihood.argmax())
        if likelihood[place] > best:
            best = float(likelihood[place])
            chosen = _RATIOS[place] * field, float(variance[place])
    field, variance = chosen
    whole = field + np.eye(axes * count) + _FREE * unit.T @ unit
    kept = np.linalg.inv(whole)
    covariance = variance * (np.eye(axes * count) - kept)
    return PlaceGuess((kept @ error).reshape(-1, axes), covariance, float(np.sqrt(variance)))


def guess_in_motion(
    guess: PlaceGuess,
    shifts: FloatArray,
    placed: PlacedMarkers,
    errors: MotionErrors,
    displaced: FloatArray,
    rigid: FloatArray,
) -> FloatArray:
    """Return more probable shifts (M, 3) [m] by the motion of a solved take: a Gauss-Newton step.

    The part of the residual that weights and head motion could explain is no evidence of places and
    is projected out (variable projection, Golub and Pereyra 1973, as approximated by Kaufman 1975).

    Parameters
    ----------
    guess : PlaceGuess
        The prior.
    shifts : (M, 3) float64 [m]
        Of `placed`.
    placed : PlacedMarkers
    errors : MotionErrors
        Of the motion, with the weights as solved with these places.
    displaced : (F, M, 3) float64 [m]
        Of the markers on the character; NaN where occluded.
    rigid : (3 M, 6) float64
        Orthonormal small head motions; (3 M, 0) for a head that rests.
    """
    count, weights = len(shifts), errors.weights
    predicted = placed.evaluator.displacements(weights)
    residual = displaced.reshape(len(displaced), -1) - predicted
    seen = ~np.isnan(residual)
    residual = np.where(seen, residual, 0.0)
    slopes = np.stack([one.displacements(weights) for one in placed.slopes], axis=2)
    slopes = np.where(seen[..., None], slopes, 0.0)
    kept = _not_explained(placed.evaluator, weights, rigid, errors.variance)
    flat = slopes.reshape(len(slopes), -1)
    weighted = errors.weighted(flat)
    gram = (flat.T @ weighted).reshape(count, 3, 2, count, 3, 2)
    kept = kept.reshape(count, 3, count, 3)
    normal = np.einsum("miankb,mink->manb", gram, kept, optimize=True)
    right = np.einsum(
        "fmia,mink,fnk->ma", weighted.reshape(-1, count, 3, 2), kept,
        residual.reshape(-1, count, 3), optimize=True,
    )  # fmt: skip
    along = block_diag(*placed.tangents.transpose(0, 2, 1))
    before = guess.precision(along)
    expected = along.T @ (guess.mean - shifts).ravel()
    step = np.linalg.solve(
        normal.reshape(2 * count, -1) + before, right.ravel() + before @ expected
    )
    return np.asarray(shifts + (along @ step).reshape(-1, 3))


def search_in_motion(
    guess: PlaceGuess,
    surface: MarkerSurface,
    marker: int,
    errors: MotionErrors,
    displaced: FloatArray,
    sized: Callable[[BlendShapeEvaluator], BlendShapeEvaluator],
) -> FloatArray:
    """Return the shift (3,) [m] of one marker to the nearby vertex that moves most like it.

    For a marker that moves unlike its place: gradients do not lead from one lip to the other.
    Parameters are those of `guess_in_motion` and `usdface.retarget.refined_fit.refine_places`;
    `marker` is its number.
    """
    near = surface.vertices_near(marker)
    frames = np.flatnonzero(~np.isnan(displaced[:, marker, 0]))
    frames = frames[:: max(1, len(frames) // _SEARCHED)]
    evaluator, _ = evaluator_of(surface.mesh.shapes, near)
    sampled = errors.at(frames)
    moved = sized(evaluator).displacements(sampled.weights).reshape(len(frames), -1, 3)
    off = (moved - displaced[frames, marker][:, None]).reshape(len(frames), -1)
    error = (off * sampled.weighted(off)).sum(axis=0).reshape(-1, 3).sum(axis=1)
    shifts = surface.mesh.points[near] - surface.mesh.points[surface.vertices[marker]]
    return np.asarray(shifts[(error + guess.improbability(marker, shifts)).argmin()])


def _not_explained(
    evaluator: BlendShapeEvaluator, weights: FloatArray, rigid: FloatArray, variance: float
) -> FloatArray:
    """Return the matrix that takes weights and head motion out of displacements: (3 M, 3 M)."""
    size = evaluator.offsets.shape[1]
    expected = weights.T @ weights / len(weights) + _STILL * np.eye(weights.shape[1])
    explained = evaluator.offsets.T @ expected @ evaluator.offsets / variance
    return np.asarray(np.linalg.inv(np.eye(size) + explained + _FREE * rigid @ rigid.T))
