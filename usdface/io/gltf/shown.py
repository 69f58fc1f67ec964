"""One mesh of a glTF as a player shows it at any time.

Source: glTF 2.0 specification, sections 3.7.2 (morph targets), 3.7.3 (skins), appendix C
(interpolation).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from usdface.takes import FloatArray, IntArray

__all__ = ["ShownMesh"]


@dataclass(frozen=True, eq=False, slots=True)
class ShownMesh:
    """One mesh as a player shows it.

    Attributes
    ----------
    name : str
    targets : tuple of str, length T
        Names of the morph targets.
    points, normals : (N, 3) float64
        At rest, the vertices that faces use; one that primitives with other attributes share
        is there once for each. Normals are None where there are none, or where a target moves
        points but not normals: programs differ in what they then show.
    moves, turns : (T, N, 3) float32
        What targets add to points and normals.
    times : (K,) float64 [s]
        Keys of the first animation of its weights; (1,) zeros where there is none.
    weights : (K, T) float64
    interpolation : str
        LINEAR, STEP or CUBICSPLINE; for the last `weights` are (K, 3, T) with tangents.
    inbetweens : tuple of (int, int, float)
        Targets that our extras call inbetweens: the target's place, its shape's, its weight.
    matrices : (N, 4, 4) or (4, 4) float64
        Node or skin to the scene, at rest; for column vectors.
    turning : (N, 3, 3) or (3, 3) float64
        The same for normals; a skin blends what turns the normals of its joints.
    """

    name: str
    targets: tuple[str, ...]
    points: FloatArray
    normals: FloatArray | None
    moves: NDArray[np.float32]
    turns: NDArray[np.float32]
    times: FloatArray
    weights: FloatArray
    interpolation: str
    inbetweens: tuple[tuple[int, int, float], ...]
    matrices: FloatArray
    turning: FloatArray

    def weights_at(self, times: FloatArray) -> FloatArray:
        """Return the weights (F, T) at `times` (F,) [s]."""
        place = (np.searchsorted(self.times, times, side="right") - 1).clip(min=0)
        if self.interpolation == "STEP":
            held: FloatArray = self.weights[place]
            return held
        if self.interpolation == "CUBICSPLINE":
            return self._cubic(times, place)
        if not self.targets:
            return np.zeros((len(times), 0))
        return np.stack([np.interp(times, self.times, column) for column in self.weights.T], 1)

    def _cubic(self, times: FloatArray, place: IntArray) -> FloatArray:
        last = len(self.times) - 1
        follow = (place + 1).clip(max=last)
        span = np.where(follow > place, self.times[follow] - self.times[place], 1.0)
        s = ((times - self.times[place]) / span).clip(0, 1)[:, None]
        s, span = np.where(follow > place, s.T, 0.0).T, span[:, None]
        (_, start, leave), (arrive, stop, _) = (
            self.weights[k].swapaxes(0, 1) for k in (place, follow)
        )
        return np.asarray(
            (2 * s**3 - 3 * s**2 + 1) * start
            + (s**3 - 2 * s**2 + s) * span * leave
            + (3 * s**2 - 2 * s**3) * stop
            + (s**3 - s**2) * span * arrive
        )

    def channels_at(self, times: FloatArray) -> tuple[tuple[str, ...], FloatArray]:
        """Return names (C) and weights (F, C) of the targets, inbetweens as parts of theirs."""
        weights = self.weights_at(times).copy()
        for target, shape, place in self.inbetweens:
            weights[:, shape] += place * weights[:, target]
        inner = {target for target, _, _ in self.inbetweens}
        kept = [k for k in range(len(self.targets)) if k not in inner]
        return tuple(self.targets[k] for k in kept), weights[:, kept]

    def points_at(self, times: FloatArray) -> FloatArray:
        """Return the points (F, N, 3) [m] at `times` (F,) [s], in the scene."""
        posed = self.points + np.tensordot(self.weights_at(times), self.moves, 1)
        return _times(self.matrices[..., :3, :3], posed) + self.matrices[..., :3, 3]

    def normals_at(self, times: FloatArray) -> FloatArray | None:
        """Return unit normals (F, N, 3) at `times` (F,) [s], in the scene."""
        if self.normals is None:
            return None
        posed = self.normals + np.tensordot(self.weights_at(times), self.turns, 1)
        turned = _times(self.turning, posed)
        length = np.sqrt(np.einsum("fvi,fvi->fv", turned, turned))[..., None]
        return np.asarray(turned / np.where(length > 0, length, 1.0))


def _times(matrices: FloatArray, vectors: FloatArray) -> FloatArray:
    """Apply one matrix, or one for each vertex, to vectors (F, N, 3)."""
    if matrices.ndim == 2:
        return np.asarray(vectors @ matrices.T, np.float64)
    return np.asarray(np.einsum("nij,fnj->fni", matrices, vectors), np.float64)
