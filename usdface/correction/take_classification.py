"""Classification of the expressions of a take, by the motion of the whole face and each half."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from usdface.arrays import FloatArray
from usdface.correction.expression_classifier import Classification, ExpressionClassifier
from usdface.correction.features import smoothed_blocks
from usdface.face.bound_face import BoundFace
from usdface.face.mirror import Side, half_face
from usdface.numerics.frame_blocks import by_blocks
from usdface.retarget.solution import Solution

__all__ = ["SidedMotion", "classify_take", "recorded_motion"]

# Displacements (B, M, 3) [m] of the markers of each side in some frames.
SidedMotion = Callable[[slice], Mapping[Side, FloatArray]]


def classify_take(
    classifiers: Mapping[Side, ExpressionClassifier], motion: SidedMotion, frame_count: int
) -> dict[Side, Classification]:
    """Classify the motion of each side over a take.

    Parameters
    ----------
    classifiers : mapping of "both", "left", "right" to ExpressionClassifier
    motion : callable
        Returns the displacements (B, M, 3) [m] of the sides of `classifiers` in a block of frames.
    frame_count : int
    """

    def classified(frames: slice) -> FloatArray:
        moved = motion(frames)
        found = [each.classify(moved[side]) for side, each in classifiers.items()]
        sides = [[each.confidence, each.amplitude, each.contradiction] for each in found]
        return np.stack([np.stack(values, axis=1) for values in sides], axis=1)

    values = by_blocks(frame_count, classified)
    by_side = enumerate(classifiers)
    return {side: Classification(*np.moveaxis(values[:, k], 1, 0)) for k, side in by_side}


def recorded_motion(
    face: BoundFace,
    solution: Solution,
    sides: Sequence[Side],
    *,
    times: FloatArray,
    width: float,
) -> SidedMotion:
    """Return the recorded motion of the markers, in the space of the character.

    Markers that were not used stay at rest. The solved motion would not do: a solve loses motion
    that the character's blend shapes cannot follow, and with it the differences of other faces.

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

    def recorded(frames: slice) -> FloatArray:
        used = solution.displaced(frames)[:, order]
        moved = np.zeros((len(used), *face.neutral.shape))
        moved[:, known] = used
        return moved

    # Smoothed once: mirroring is linear.
    smoothed = smoothed_blocks(recorded, times, width)

    def motion(frames: slice) -> Mapping[Side, FloatArray]:
        whole = smoothed(frames)
        rest = np.zeros_like(face.neutral)
        return {
            side: whole if side == "both" else half_face(whole, rest, face.neutral, face.nose, side)
            for side in sides
        }

    return motion
