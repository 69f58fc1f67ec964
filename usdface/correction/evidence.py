"""Evidence: which regions of a face match an expression, so that no others are corrected.

Rules detect an emotion from a few markers. Whether the whole face moves as in its pose is judged by
the solved weights: a mouth that speaks, puckers or rests while the brows frown is not angry.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from usdface.arrays import BoolArray, FloatArray
from usdface.face.bound_face import BoundFace
from usdface.face.regions import GainRegion
from usdface.numerics.cosines import cosines
from usdface.numerics.ramps import linear_ramp
from usdface.options import SolveOptions

__all__ = ["Evidence", "evidence_of"]

# Shares of its weight in the expression up to which a blend shape takes no part, and from which on
# it takes full part. Set by benchmarks/expression_takes.py.
_PARTICIPATION = (0.5, 0.7)
# Margin below and above the similarity of a region at which it matches half the pose; it ends at 0
# and at 1. A steep ramp lets noise decide: other persons' expressions at half, with markers 4 mm
# off, were corrected by up to 0.59 more with one noise than with another where it was 0.03 around a
# similarity of 0.84 that discounts each shape by itself, now by 0.13; recorded motion is changed as
# little.
_AROUND = 0.08
# Error of a marker on another person's face [m]: the weight of a shape that moves the markers by
# less is hardly determined.
_FACE_ERROR = 0.0005


@dataclass(frozen=True, eq=False)
class Evidence:
    """Judges whether solved weights match an expression.

    Attributes
    ----------
    determined : (T, T) float64
        How far the markers determine weights, 0 to 1 (see `_determined`): weights, and mixtures of
        weights, that are not determined are no evidence, for or against.
    motion : (T, K) float64 [m]
        Displacements of the markers' coordinates by each blend shape, on a human face.
    least : float
        Similarity of a region to that of a pose at which it matches half of it; 0 = any weights
        match any pose.
    regions : mapping of str to (T,) bool
        The regions that have to match an expression, if it has blend shapes there. The eyes
        are not among them: markers hardly determine lids.
    """

    determined: FloatArray
    motion: FloatArray
    least: float
    regions: dict[GainRegion, BoolArray]

    @cached_property
    def determination(self) -> FloatArray:
        """The share of each weight that the markers determine, of each alone: (T,), 0 to 1."""
        return np.clip(np.diag(self.determined), 0.0, 1.0)  # rounding in shapes that move by metres

    @cached_property
    def _root(self) -> FloatArray:
        """The square root of `determined`: (T, T)."""
        values, vectors = np.linalg.eigh(self.determined)
        return np.asarray((vectors * np.sqrt(values.clip(min=0.0))) @ vectors.T)

    def match(self, weights: FloatArray, pose: FloatArray) -> dict[GainRegion, FloatArray]:
        """Return how far weights (N, T) match a pose (T,) in each region, 0 to 1: (N,)."""
        if self.least == 0:
            return {region: np.ones(len(weights)) for region in self.regions}
        lowest, highest = max(self.least - _AROUND, 0.0), min(self.least + _AROUND, 1.0)
        return {
            region: linear_ramp(self._similarity(weights, pose, region), lowest, highest)
            for region in self.regions
        }

    def _similarity(self, weights: FloatArray, pose: FloatArray, region: GainRegion) -> FloatArray:
        """Return the similarity of weights (N, T) and a pose (T,) in a region, 0 to 1: (N,).

        The cosine of their weights as far as they are determined, or its geometric mean with that
        of the markers' motion where this is larger. The weights differ where the solve took a
        similar blend shape; in the motion alone an open jaw outweighs all else.
        """
        own = self.regions[region]
        wanted, there = (np.where(own, w, 0.0) for w in (pose, weights))
        if not (self.determination * wanted).any():
            return np.ones(len(weights))
        shapes = cosines(there @ self._root, wanted @ self._root)
        markers = cosines(there @ self.motion, wanted @ self.motion)
        return np.asarray(np.sqrt(np.maximum(shapes, 0.0) * np.maximum(shapes, markers)))

    def participation(
        self, weights: FloatArray, pose: FloatArray, size: FloatArray, by_rules: FloatArray
    ) -> FloatArray:
        """Return how far each blend shape takes part in expressions: (N, T), 0 to 1.

        By its share of its weight in an expression of that size (`_PARTICIPATION`), plus the
        deviation that the markers leave on another person's face: an undetermined shape takes part,
        as far as rules detect the expression.

        Parameters
        ----------
        weights : (N, T) float64
        pose : (T,) float64
        size : (N,) float64
        by_rules : (N,) float64
            The share of the output that is of the rules, not of the classifier alone, 0 to 1.
        """
        moved = pose > 0
        if self.least == 0:
            return np.tile(moved.astype(np.float64), (len(weights), 1))
        wanted, there = (
            self.determination * pose,
            self.determination * np.where(moved, weights, 0.0),
        )
        # Weighted by the weights, so that shapes at rest do not reduce the size.
        solved = (there**2).sum(axis=1) / np.maximum(there @ wanted, 1e-12)
        unsure = by_rules[:, None] * SolveOptions().spread * np.sqrt(1.0 - self.determination)
        whole = np.maximum(size, solved)[:, None] * np.where(moved, pose, 1.0)
        share = (weights + unsure) / np.maximum(whole, 1e-12)
        return np.where(moved, linear_ramp(share, *_PARTICIPATION), 0.0)


def evidence_of(face: BoundFace, names: Sequence[str], least: float) -> Evidence:
    """Return the evidence that the bound markers of a face give for the weights `names`."""
    index = {name: i for i, name in enumerate(face.shape_names)}
    known = [i for i, name in enumerate(names) if name in index]
    at = [index[names[i]] for i in known]
    basis = face.offsets / face.size
    basis = basis.reshape(len(face.shape_names), 3 * len(face.markers))
    determined, motion = np.zeros((len(names),) * 2), np.zeros((len(names), basis.shape[1]))
    determined[np.ix_(known, known)] = _determined(basis)[np.ix_(at, at)]
    motion[known] = basis[at]
    layout = face.layout.regions
    eyes = set(layout.get("eyes", ()))
    regions: dict[GainRegion, BoolArray] = {
        "brows": np.isin(names, layout.get("brows", ())),
        "mouth": np.array([n not in eyes and n not in layout.get("brows", ()) for n in names]),
    }
    return Evidence(determined, motion, least, regions)


def _determined(basis: FloatArray) -> FloatArray:
    """Return by how much the markers of one frame reduce the covariance of weights: (S, S).

    I less the posterior by the prior covariance, both of ridge regression. A smile that the markers
    cannot tell from another mixture of shapes is 0 along the difference of the two.
    """
    scaled = SolveOptions().spread * basis / _FACE_ERROR
    gram = scaled @ scaled.T
    return np.asarray(np.linalg.solve(gram + np.eye(len(gram)), gram))
