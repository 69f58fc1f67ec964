"""Likeness over a take: the motion of its markers on the character, of the face and each half."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from usdface.arrays import FloatArray
from usdface.correction.expression_classifier import ExpressionLikeness, Likeness
from usdface.correction.features import smoothed_blocks
from usdface.face.bound_face import BoundFace
from usdface.face.mirror import Side, half_face
from usdface.numerics.frame_blocks import by_blocks
from usdface.retarget.solution import Solution

__all__ = ["SidedMotion", "carried_motion", "take_likeness"]

# Displacements (B, M, 3) [m] of the markers of each side in some frames.
SidedMotion = Callable[[slice], Mapping[Side, FloatArray]]


def take_likeness(
    judges: Mapping[Side, ExpressionLikeness], motion: SidedMotion, frame_count: int
) -> dict[Side, Likeness]:
    """Judge the motion of each side over a take.

    Parameters
    ----------
    judges : mapping of "both", "left", "right" to ExpressionLikeness
    motion : callable
        Returns the displacements (B, M, 3) [m] of the sides of `judges` in a block of frames.
    frame_count : int
    """

    def judged(frames: slice) -> FloatArray:
        moved = motion(frames)
        found = [judge.of(moved[side]) for side, judge in judges.items()]
        sides = [np.stack([each.certain, each.size, each.contrary], axis=1) for each in found]
        return np.stack(sides, axis=1)

    values = by_blocks(frame_count, judged)
    return {side: Likeness(*np.moveaxis(values[:, k], 1, 0)) for k, side in enumerate(judges)}


def carried_motion(
    face: BoundFace,
    solution: Solution,
    sides: Sequence[Side],
    *,
    times: FloatArray,
    width: float,
) -> SidedMotion:
    """Return the recorded motion of the markers, carried over to the character, not the solved one.

    Markers that were not used stay at rest. A solve loses motion that the character's blend shapes
    cannot show, and with it the differences of other faces.

    Parameters
    ----------
    face : BoundFace
    solution : Solution
    sides : sequence of {"both", "left", "right"}
    times : (F,) float64 [s]
    width : float [s]
        Standard deviation of the Gaussian by which motion is smoothed, as features are.
    """
    index = {name: k for k, name in enumerate(solution.markers)}
    known = np.array([name in index for name in face.markers])
    order = [index[name] for name in face.markers if name in index]

    def carried(frames: slice) -> FloatArray:
        used = solution.displaced(frames)[:, order]
        moved = np.zeros((len(used), *face.neutral.shape))
        moved[:, known] = used
        return moved

    # Smoothed once: mirroring is linear.
    smoothed = smoothed_blocks(carried, times, width)

    def motion(frames: slice) -> Mapping[Side, FloatArray]:
        whole = smoothed(frames)
        rest = np.zeros_like(face.neutral)
        return {
            side: whole if side == "both" else half_face(whole, rest, face.neutral, face.nose, side)
            for side in sides
        }

    return motion
