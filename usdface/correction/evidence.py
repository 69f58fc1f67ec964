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

# A blend shape takes part if it has this share of the size of the expression; set by
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
    least : float
        Least likeness of the weights of a region to those of a pose (cosine); 0 = any weights show
        any pose.
    regions : mapping of str to (T,) bool
        The regions that an expression has to be shown in, if it has blend shapes there. The eyes
        are not among them: markers hardly see lids.
    """

    seen: FloatArray
    least: float
    regions: dict[GainRegion, BoolArray]

    def missing(self, weights: FloatArray, pose: FloatArray) -> tuple[GainRegion, ...]:
        """Return the regions in which weights (T,) do not show a pose (T,)."""
        found: list[GainRegion] = []
        if self.least == 0:
            return ()
        for region, own in self.regions.items():
            wanted, there = (self.seen * np.where(own, w, 0.0) for w in (pose, weights))
            lengths = float(np.linalg.norm(wanted) * np.linalg.norm(there))
            if wanted.any() and not wanted @ there > self.least * lengths:
                found.append(region)
        return tuple(found)

    def takes_part(self, weights: FloatArray, pose: FloatArray, size: float) -> BoolArray:
        """Return which blend shapes take part in an expression of some size: (T,).

        One that the markers do not see is believed to be as strong as the expression.
        """
        if self.least == 0:
            return np.asarray(pose > 0)
        wanted = self.seen * pose
        shown = float(wanted @ (self.seen * weights)) / max(float(wanted @ wanted), 1e-12)
        size = max(size, shown)
        share = np.divide(weights, pose, out=np.zeros(len(pose)), where=pose > 0)
        believed = self.seen * share + (1.0 - self.seen) * size
        return np.asarray((pose > 0) & (believed >= _TAKES_PART * size))


def evidence_of(face: BoundFace, names: Sequence[str], least: float) -> Evidence:
    """Return the evidence that the bound markers of a face give for the weights `names`."""
    index = {name: i for i, name in enumerate(face.shape_names)}
    known = _seen(face)
    seen = np.array([known[index[name]] if name in index else 0.0 for name in names])
    layout = face.layout.regions
    eyes = set(layout.get("eyes", ()))
    regions: dict[GainRegion, BoolArray] = {
        "brows": np.isin(names, layout.get("brows", ())),
        "mouth": np.array([n not in eyes and n not in layout.get("brows", ()) for n in names]),
    }
    return Evidence(seen, least, regions)


def _seen(face: BoundFace) -> FloatArray:
    """Return the reduction of each weight's variance by the markers of one frame: (S,)."""
    if not len(face.markers):
        return np.zeros(len(face.shape_names))
    basis = face.offsets.reshape(len(face.shape_names), -1) / _FACE_ERROR
    spread = SolveOptions().spread
    posterior = np.linalg.inv(basis @ basis.T + np.eye(len(basis)) / spread**2)
    return np.asarray(np.clip(1.0 - np.diag(posterior) / spread**2, 0.0, 1.0))
