"""Evidence: where a face really shows an expression, so that nothing is written elsewhere.

Rules hear an emotion from a few markers. Whether the whole face does what its pose does is seen in
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

# A blend shape takes part if it has this share of its weight in the expression; set by
# benchmarks/expression_takes.py.
_TAKES_PART = 0.6
# Error of a marker on another person's face [m]: a shape that moves the markers by less is hardly
# seen.
_FACE_ERROR = 0.0005


@dataclass(frozen=True, eq=False, slots=True)
class Evidence:
    """Judges whether solved weights show an expression.

    Attributes
    ----------
    seen : (T,) float64
        How far the markers determine the weight of each blend shape, 0 to 1. Weights that are not
        determined say nothing, for or against.
    motion : (T, K) float64 [m]
        Displacements of the markers' coordinates by each blend shape.
    least : float
        Least likeness of a region to that of a pose; 0 = any weights show any pose.
    regions : mapping of str to (T,) bool
        The regions that an expression has to be shown in, if it has blend shapes there. The eyes
        are not among them: markers hardly see lids.
    """

    seen: FloatArray
    motion: FloatArray
    least: float
    regions: dict[GainRegion, BoolArray]

    def missing(self, weights: FloatArray, pose: FloatArray) -> tuple[GainRegion, ...]:
        """Return the regions in which weights (T,) do not show a pose (T,)."""
        if self.least == 0:
            return ()
        return tuple(r for r in self.regions if not self._likeness(weights, pose, r) > self.least)

    def _likeness(self, weights: FloatArray, pose: FloatArray, region: GainRegion) -> float:
        """Return how alike weights (T,) and a pose (T,) are in a region, 0 to 1.

        The cosine of their weights, or its geometric mean with that of the markers' motion where
        this is more alike. The weights alone mistake what the solve explains by a similar blend
        shape, the motion alone mistakes a jaw for all that it opens.
        """
        own = self.regions[region]
        wanted, there = (np.where(own, w, 0.0) for w in (pose, weights))
        if not (self.seen * wanted).any():
            return 1.0
        shapes = _cosine(self.seen * wanted, self.seen * there)
        markers = _cosine(wanted @ self.motion, there @ self.motion)
        return float(np.sqrt(max(shapes, 0.0) * max(shapes, markers)))

    def takes_part(self, weights: FloatArray, pose: FloatArray, size: float) -> BoolArray:
        """Return which blend shapes take part in an expression of some size: (T,).

        Those that have `_TAKES_PART` of their weight in it, less what the markers leave open on
        another person's face: one that they do not see takes part.
        """
        if self.least == 0:
            return np.asarray(pose > 0)
        wanted, there = self.seen * pose, self.seen * np.where(pose > 0, weights, 0.0)
        # Weighted by what is there, so that a part at rest does not make the others small.
        shown = float(there @ there) / max(float(wanted @ there), 1e-12)
        unsure = SolveOptions().spread * np.sqrt(1.0 - self.seen)
        enough = _TAKES_PART * max(size, shown) * pose - unsure
        return np.asarray((pose > 0) & (weights >= enough))


def evidence_of(face: BoundFace, names: Sequence[str], least: float) -> Evidence:
    """Return the evidence that the bound markers of a face give for the weights `names`."""
    index = {name: i for i, name in enumerate(face.shape_names)}
    known = [i for i, name in enumerate(names) if name in index]
    at = [index[names[i]] for i in known]
    basis = face.offsets.reshape(len(face.shape_names), 3 * len(face.markers))
    seen, motion = np.zeros(len(names)), np.zeros((len(names), basis.shape[1]))
    seen[known], motion[known] = _seen(basis)[at], basis[at]
    layout = face.layout.regions
    eyes = set(layout.get("eyes", ()))
    regions: dict[GainRegion, BoolArray] = {
        "brows": np.isin(names, layout.get("brows", ())),
        "mouth": np.array([n not in eyes and n not in layout.get("brows", ()) for n in names]),
    }
    return Evidence(seen, motion, least, regions)


def _seen(basis: FloatArray) -> FloatArray:
    """Return the reduction of each weight's variance by the markers of one frame: (S,)."""
    scaled = basis / _FACE_ERROR
    spread = SolveOptions().spread
    posterior = np.linalg.inv(scaled @ scaled.T + np.eye(len(scaled)) / spread**2)
    return np.asarray(np.clip(1.0 - np.diag(posterior) / spread**2, 0.0, 1.0))


def _cosine(a: FloatArray, b: FloatArray) -> float:
    lengths = float(np.linalg.norm(a) * np.linalg.norm(b))
    return float(a @ b) / lengths if lengths else 0.0
