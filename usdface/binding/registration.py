"""A registration of markers to a rig's face, and the errors of place, motion and name in it."""

from dataclasses import dataclass

import numpy as np

from usdface.arrays import FloatArray, IntArray
from usdface.binding.candidates import CandidateVertices
from usdface.binding.name_priors import name_errors
from usdface.binding.observations import Observations
from usdface.geometry.rigid_fit import mean_scale

__all__ = [
    "MOTION_ERROR",
    "SHAPE_ERROR",
    "USUAL_COST",
    "Registration",
    "expected_scale",
    "named_errors",
    "squared_distances",
    "squared_errors",
    "total_errors",
    "trust_of",
]

# Lengths are shares of the face's size, the RMS radius of its moving surface (ICT: 67 mm). Numbers
# without another source were set by hand; judge: `python benchmarks/binding.py`;
# docs/constants.md lists them.

# Standard deviations of a marker's place once the face is mapped and bent, and of its motion.
SHAPE_ERROR, MOTION_ERROR = 0.06, 0.02
# Factor on the error of motion where names give the places, as that of real performers on other
# faces is larger; judge: `python benchmarks/binding.py named`.
_NAMED_MOTION = 6.0
# Cost of a good registration to another face; a larger cost means larger errors.
USUAL_COST = 3.0
# Moving markers spread like the moving surface: bias of the logarithm of the ratio
# (mean of three performers each of ICT's face and the example's: -0.20 to -0.04).
_SPREAD_BIAS = -0.14
# Independent observations of a marker's motion in all peak frames, which resemble each other.
_INDEPENDENT_PEAKS = 8.0
# Degrees of freedom of the Student-t errors, so that one marker off the face does not pull all
# (K. Lange, R. Little, J. Taylor, "Robust statistical modeling using the t distribution", 1989).
_DEGREES_OF_FREEDOM = 8.0


@dataclass(frozen=True, eq=False, slots=True)
class Registration:
    """A registration of M markers to N candidates, with the weights of K peak frames.

    Attributes
    ----------
    linear : (3, 3) float64
        Scale times rotation: row vectors of the performer's space times it are the character's.
    offset : (3,) float64 [m]
    bend : (M, 3) float64 [m]
        Smooth displacement of the markers beyond the similarity.
    weights : (K, S) float64 in [0, 1]
    rigid : (K, 6) float64
        Residual head motion in the peak frames (`CandidateVertices.rigid_motions`).
    assigned : (M,) int64
        Index of each marker's candidate.
    marker_costs : (M,) float64
        Squared errors of place and motion there, in units of the expected ones.
    cost : float
        Mean over the markers, with the costs of scale, bend and pose.
    """

    linear: FloatArray
    offset: FloatArray
    bend: FloatArray
    weights: FloatArray
    rigid: FloatArray
    assigned: IntArray
    marker_costs: FloatArray
    cost: float


def expected_scale(candidates: CandidateVertices, observations: Observations) -> float:
    """Return the expected ratio of the character's size to the performer's."""
    return float(np.exp(_SPREAD_BIAS)) * candidates.size / observations.spread


def squared_errors(
    candidates: CandidateVertices,
    observations: Observations,
    registration: Registration,
    *,
    shape_error: float = SHAPE_ERROR,
    motion_error: float = MOTION_ERROR,
) -> tuple[FloatArray, FloatArray]:
    """Return squared errors of place and of motion of each marker at each candidate.

    In units of the expected errors, which grow with the registration's scale: otherwise the
    smallest face would always fit best.

    Parameters
    ----------
    candidates : CandidateVertices
    observations : Observations
    registration : Registration
    shape_error, motion_error : float
        Expected errors as shares of the face's size.

    Returns
    -------
    place, motion : (M, N) float64
    """
    ratio = mean_scale(registration.linear) / expected_scale(candidates, observations)
    unit = candidates.size * ratio
    mapped = observations.neutral @ registration.linear + registration.offset + registration.bend
    place = squared_distances(mapped, candidates.points) / (shape_error * unit) ** 2
    count = len(registration.weights)
    predicted = registration.weights @ candidates.offsets.reshape(len(candidates.offsets), -1)
    predicted += registration.rigid @ candidates.rigid_motions.reshape(6, -1)
    vertex = np.ascontiguousarray(predicted.reshape(count, -1, 3).transpose(1, 0, 2))
    marker = (observations.displacements @ registration.linear).transpose(1, 0, 2)
    visible = observations.visible.T.astype(np.float64)
    own = np.einsum("mkd,mkd,mk->m", marker, marker, visible)
    both = (marker * visible[..., None]).reshape(len(marker), -1) @ vertex.reshape(
        len(vertex), -1
    ).T
    theirs = visible @ np.einsum("nkd,nkd->kn", vertex, vertex)
    motion = (own[:, None] - 2.0 * both + theirs).clip(min=0.0)
    independent = _INDEPENDENT_PEAKS / np.maximum(visible.sum(axis=1), 1.0)
    trusted = 1.0 if observations.named is None else _NAMED_MOTION
    motion *= independent[:, None] / (trusted * motion_error * unit) ** 2
    # Heavy tails: a motion that no vertex has does not decide on the marker's place.
    return place, _DEGREES_OF_FREEDOM * np.log1p(motion / _DEGREES_OF_FREEDOM)


def total_errors(
    candidates: CandidateVertices, observations: Observations, registration: Registration
) -> FloatArray:
    """Return the squared errors of place, motion and name of each marker at each candidate: (M, N).

    In units of the expected errors.
    """
    place, motion = squared_errors(candidates, observations, registration)
    return np.asarray(place + motion + named_errors(candidates, observations))


def named_errors(candidates: CandidateVertices, observations: Observations) -> FloatArray | float:
    """Return the squared errors of the names: (M, N), in units of the expected ones; 0 without."""
    if observations.named is None:
        return 0.0
    return name_errors(observations.named, candidates.points + candidates.centre)


def trust_of(costs: FloatArray) -> FloatArray:
    """Return the weights (M,) of markers in Student-t fits, by their costs."""
    return np.asarray(1.0 / (1.0 + costs / _DEGREES_OF_FREEDOM))


def squared_distances(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return squared distances between (M, 3) and (N, 3): (M, N)."""
    total = (a**2).sum(axis=1)[:, None] - 2.0 * a @ b.T + (b**2).sum(axis=1)
    return np.asarray(total.clip(min=0.0))
