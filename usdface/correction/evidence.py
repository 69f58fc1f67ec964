"""Evidence: which regions of a face show an expression, so that no others are corrected.

Rules detect an emotion from a few markers. Whether the whole face moves as in its pose is judged by
the solved weights: a mouth that speaks, puckers or rests while the brows frown is not angry.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from usdface.arrays import BoolArray, FloatArray
from usdface.face.bound_face import BoundFace
from usdface.face.regions import GainRegion
from usdface.options import SolveOptions

__all__ = ["Evidence", "evidence_of"]

# Shares of its weight in the expression up to which a blend shape takes no part, and from which on
# it takes full part. Set by benchmarks/expression_takes.py.
_TAKES_PART = (0.5, 0.7)
# Margin below and above the likeness of a region at which it shows half the pose. A steep ramp lets
# noise decide: other persons' expressions at half, with markers 4 mm off, are corrected by up to
# 0.59 more with one noise than with another where it is 0.03 around 0.84, by 0.24 where it is 0.1
# around 0.8; recorded motion changed by more than 0.1 goes from 2.0 to 3.4 % of the frames at most.
_AROUND = 0.1
# Error of a marker on another person's face [m]: the weight of a shape that moves the markers by
# less is hardly determined.
_FACE_ERROR = 0.0005


@dataclass(frozen=True, eq=False, slots=True)
class Evidence:
    """Judges whether solved weights show an expression.

    Attributes
    ----------
    seen : (T,) float64
        How far the markers determine the weight of each blend shape, 0 to 1. Weights that are not
        determined are no evidence, for or against.
    motion : (T, K) float64 [m]
        Displacements of the markers' coordinates by each blend shape, on a human face.
    least : float
        Likeness of a region to that of a pose at which it shows half of it; 0 = any weights show
        any pose.
    regions : mapping of str to (T,) bool
        The regions that an expression has to be shown in, if it has blend shapes there. The eyes
        are not among them: markers hardly determine lids.
    """

    seen: FloatArray
    motion: FloatArray
    least: float
    regions: dict[GainRegion, BoolArray]

    def shown(self, weights: FloatArray, pose: FloatArray) -> dict[GainRegion, FloatArray]:
        """Return how far weights (N, T) show a pose (T,) in each region, 0 to 1: (N,)."""
        if self.least == 0:
            return {region: np.ones(len(weights)) for region in self.regions}
        lowest = self.least - _AROUND
        return {
            region: _ramp((self._likeness(weights, pose, region) - lowest) / (2 * _AROUND))
            for region in self.regions
        }

    def _likeness(self, weights: FloatArray, pose: FloatArray, region: GainRegion) -> FloatArray:
        """Return how alike weights (N, T) and a pose (T,) are in a region, 0 to 1: (N,).

        The cosine of their weights, or its geometric mean with that of the markers' motion where
        this is more alike. The weights alone differ where the solve took a similar blend shape; in
        the motion alone an open jaw outweighs all else.
        """
        own = self.regions[region]
        wanted, there = (np.where(own, w, 0.0) for w in (pose, weights))
        if not (self.seen * wanted).any():
            return np.ones(len(weights))
        shapes = _cosine(self.seen * wanted, self.seen * there)
        markers = _cosine(wanted @ self.motion, there @ self.motion)
        return np.asarray(np.sqrt(np.maximum(shapes, 0.0) * np.maximum(shapes, markers)))

    def takes_part(
        self, weights: FloatArray, pose: FloatArray, size: FloatArray, by_rules: FloatArray
    ) -> FloatArray:
        """Return how far each blend shape takes part in expressions: (N, T), 0 to 1.

        By its share of its weight in an expression of that size (`_TAKES_PART`), plus the deviation
        that the markers leave on another person's face: an undetermined shape takes part, as far
        as rules detect the expression.

        Parameters
        ----------
        weights : (N, T) float64
        pose : (T,) float64
        size : (N,) float64
        by_rules : (N,) float64
            The share of the output that is of the rules, not of likeness alone, 0 to 1.
        """
        moved = pose > 0
        if self.least == 0:
            return np.tile(moved.astype(np.float64), (len(weights), 1))
        wanted, there = self.seen * pose, self.seen * np.where(moved, weights, 0.0)
        # Weighted by the weights, so that shapes at rest do not reduce the size.
        shown = (there**2).sum(axis=1) / np.maximum(there @ wanted, 1e-12)
        unsure = by_rules[:, None] * SolveOptions().spread * np.sqrt(1.0 - self.seen)
        whole = np.maximum(size, shown)[:, None] * np.where(moved, pose, 1.0)
        share = (weights + unsure) / np.maximum(whole, 1e-12)
        few, enough = _TAKES_PART
        return np.where(moved, _ramp((share - few) / (enough - few)), 0.0)


def evidence_of(face: BoundFace, names: Sequence[str], least: float) -> Evidence:
    """Return the evidence that the bound markers of a face give for the weights `names`."""
    index = {name: i for i, name in enumerate(face.shape_names)}
    known = [i for i, name in enumerate(names) if name in index]
    at = [index[names[i]] for i in known]
    basis = face.offsets / face.size
    basis = basis.reshape(len(face.shape_names), 3 * len(face.markers))
    determined, motion = np.zeros(len(names)), np.zeros((len(names), basis.shape[1]))
    determined[known], motion[known] = _determined(basis)[at], basis[at]
    layout = face.layout.regions
    eyes = set(layout.get("eyes", ()))
    regions: dict[GainRegion, BoolArray] = {
        "brows": np.isin(names, layout.get("brows", ())),
        "mouth": np.array([n not in eyes and n not in layout.get("brows", ()) for n in names]),
    }
    return Evidence(determined, motion, least, regions)


def _determined(basis: FloatArray) -> FloatArray:
    """Return the reduction of each weight's variance by the markers of one frame: (S,)."""
    scaled = basis / _FACE_ERROR
    spread = SolveOptions().spread
    posterior = np.linalg.inv(scaled @ scaled.T + np.eye(len(scaled)) / spread**2)
    return np.asarray(np.clip(1.0 - np.diag(posterior) / spread**2, 0.0, 1.0))


def _cosine(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the cosines between a vector (T,) and vectors (N, T), 0 where one is 0: (N,)."""
    lengths = np.linalg.norm(a) * np.linalg.norm(b, axis=1)
    return np.asarray(np.divide(b @ a, lengths, out=np.zeros(len(b)), where=lengths > 0))


def _ramp(x: FloatArray) -> FloatArray:
    return np.asarray(np.clip(x, 0.0, 1.0))
