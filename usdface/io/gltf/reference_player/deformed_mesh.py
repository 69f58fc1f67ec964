"""One mesh of a glTF, deformed as in a player, at any time.

Source: glTF 2.0 specification, sections 3.7.2 (morph targets), 3.7.3 (skins), appendix C
(interpolation).
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from usdface.arrays import FloatArray, IntArray
from usdface.certificate.linear_morph import LinearMorph
from usdface.certificate.stored_steps import HalfSteps, StoredSteps
from usdface.io.gltf.reference_player.morph_targets import PlayerTargets

if TYPE_CHECKING:
    from usdface.io.gltf.reference_player.node_motion import Space

__all__ = ["PlayerMesh", "Sampled"]

_BLOCK = 2**17  # matrices of one evaluation at once


@dataclass(frozen=True, eq=False, slots=True)
class Sampled:
    """A sampler of an animation.

    Attributes
    ----------
    times : (K,) float64 [s]
    values : (K, T) float64
        For CUBICSPLINE (K, 3, T) with tangents.
    interpolation : str
        LINEAR, STEP or CUBICSPLINE.
    turning : bool
        The values are quaternions x, y, z, w.
    """

    times: FloatArray
    values: FloatArray
    interpolation: str = "LINEAR"
    turning: bool = False

    def at(self, times: FloatArray) -> FloatArray:
        """Return the values (F, T) at `times` (F,) [s]."""
        place = (np.searchsorted(self.times, times, side="right") - 1).clip(min=0)
        if self.interpolation == "STEP":
            held: FloatArray = self.values[place]
            return held
        if self.interpolation == "CUBICSPLINE":
            curve = self._cubic(times, place)
            return curve / np.linalg.norm(curve, axis=1, keepdims=True) if self.turning else curve
        if self.turning and len(self.times) > 1:
            from scipy.spatial.transform import Rotation, Slerp  # few files need it

            arcs = Slerp(self.times, Rotation.from_quat(self.values))
            return np.asarray(arcs(times.clip(self.times[0], self.times[-1])).as_quat())
        if not self.values.shape[1]:
            return np.zeros((len(times), 0))
        return np.stack([np.interp(times, self.times, column) for column in self.values.T], 1)

    def _cubic(self, times: FloatArray, place: NDArray[np.int64]) -> FloatArray:
        last = len(self.times) - 1
        follow = (place + 1).clip(max=last)
        span = np.where(follow > place, self.times[follow] - self.times[place], 1.0)
        s = ((times - self.times[place]) / span).clip(0, 1)[:, None]
        s, span = np.where(follow > place, s.T, 0.0).T, span[:, None]
        (_, start, leave), (arrive, stop, _) = (
            self.values[k].swapaxes(0, 1) for k in (place, follow)
        )
        return np.asarray(
            (2 * s**3 - 3 * s**2 + 1) * start
            + (s**3 - 2 * s**2 + s) * span * leave
            + (3 * s**2 - 2 * s**3) * stop
            + (s**3 - s**2) * span * arrive
        )


@dataclass(frozen=True, eq=False, slots=True)
class PlayerMesh:
    """One mesh of a glTF in one animation.

    Attributes
    ----------
    name : str
    targets : tuple of str, length T
        Names of the morph targets.
    points, normals : (N, 3) float64
        At rest, the vertices that faces use; one that primitives with other attributes share
        is there once for each. Normals are None where there are none, or where a target moves
        points but not normals: players differ then.
    moves, turns : PlayerTargets
        Morph targets of points and normals.
    weights : Sampled
    inbetweens : tuple of (int, int, float)
        Targets that our extras call inbetweens: the target's place, its shape's, its weight.
    space : Space
    halves : HalfSteps or None
        None where points and normals are floats.
    """

    name: str
    targets: tuple[str, ...]
    points: FloatArray
    normals: FloatArray | None
    moves: PlayerTargets
    turns: PlayerTargets
    weights: Sampled
    inbetweens: tuple[tuple[int, int, float], ...]
    space: "Space"
    halves: HalfSteps | None = None

    def weights_at(self, times: FloatArray) -> FloatArray:
        """Return the weights (F, T) at `times` (F,) [s]."""
        return self.weights.at(times)

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
        return self._in_blocks(times, self._points)

    def normals_at(self, times: FloatArray) -> FloatArray | None:
        """Return unit normals (F, N, 3) at `times` (F,) [s], in the scene."""
        normals = self.normals
        if normals is None:
            return None
        return self._in_blocks(times, lambda block: self._turned(normals, block))

    def steps_at(self, times: FloatArray) -> StoredSteps | None:
        """Return the rounding of values that are stored as whole numbers, at `times` (F,) [s]."""
        if self.halves is None:
            return None
        stretch = np.broadcast_to(self.space.stretch(times), (len(times), 2))

        def lengths(frames: IntArray) -> FloatArray:
            normals = self.normals
            assert normals is not None  # compared where there are some
            shown = self._in_blocks(times[frames], lambda block: self._posed(normals, block))
            return np.asarray(np.linalg.norm(shown, axis=-1))

        return StoredSteps(self.halves, self.weights_at(times), stretch, lengths)

    def linear_morph_at(self, times: FloatArray) -> LinearMorph | None:
        """Return the mesh at `times` (F,) [s] as sums; None where too many joints move it."""
        place, turning = self.space.at(times[:1])
        weights = self.weights_at(times)
        if place.ndim > 3:
            moves, turns = self.moves.offsets(), self.turns.offsets()
            motion = self.space.motion(times, len(self.points))
            if motion is None:
                return None
            if self.normals is None:
                return LinearMorph(weights, self.points, moves, motion=motion)
            return LinearMorph(weights, self.points, moves, self.normals, turns, motion)
        points = _times(place[..., :3, :3], self.points[None])[0] + place[..., :3, 3]
        moves = self.moves.offsets(place[..., :3, :3])
        if self.normals is None:
            return LinearMorph(weights, points, moves)
        turned = _times(turning, self.normals[None])[0]
        return LinearMorph(weights, points, moves, turned, self.turns.offsets(turning))

    def _in_blocks(self, times: FloatArray, part: Callable[[FloatArray], FloatArray]) -> FloatArray:
        """Skins that move have a matrix for each vertex and time."""
        step = max(1, _BLOCK // max(len(self.points), 1))
        parts = [part(times[k : k + step]) for k in range(0, len(times), step)]
        return np.concatenate([np.zeros((0, len(self.points), 3)), *parts])

    def _points(self, times: FloatArray) -> FloatArray:
        posed = self.points + self.moves.added(self.weights_at(times))
        matrices, _ = self.space.at(times)
        return _times(matrices[..., :3, :3], posed) + matrices[..., :3, 3]

    def _posed(self, normals: FloatArray, times: FloatArray) -> FloatArray:
        """Return the normals of any length, as joints and nodes turn and stretch them."""
        posed = normals + self.turns.added(self.weights_at(times))
        return _times(self.space.at(times)[1], posed)

    def _turned(self, normals: FloatArray, times: FloatArray) -> FloatArray:
        turned = self._posed(normals, times)
        length = np.sqrt(np.einsum("fvi,fvi->fv", turned, turned))[..., None]
        return np.asarray(turned / np.where(length > 0, length, 1.0))


def _times(matrices: FloatArray, vectors: FloatArray) -> FloatArray:
    """Apply one matrix, one for each vertex, or one for each time too, to vectors (F, N, 3)."""
    if matrices.ndim == 2:
        return np.asarray(vectors @ matrices.T, np.float64)
    if matrices.ndim == 3:
        return np.asarray(np.einsum("nij,fnj->fni", matrices, vectors), np.float64)
    if matrices.shape[1] == 1:
        return np.asarray(vectors @ matrices[:, 0].swapaxes(1, 2), np.float64)
    return np.asarray(np.einsum("fnij,fnj->fni", matrices, vectors), np.float64)
