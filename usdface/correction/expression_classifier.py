"""A classifier of expressions: the emotion in the motion of all markers, or none.

Rules detect an emotion from a few markers, as far as they move as in the character's own pose.
Another person's brows and lips move differently: the right rule is mostly the strongest, but weak.
So a linear discriminant classifies the motion of all markers. It is trained on synthetic faces of
every expression (`usdface.correction.synthetic_faces`) and on movements without emotion. Where
another emotion is as probable, the rule is suppressed. All results are continuous in the markers.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from usdface.arrays import FloatArray
from usdface.correction.discriminant import (
    Discriminant,
    fisher_discriminant,
    with_room_for_wider_classes,
)
from usdface.correction.synthetic_faces import synthetic_faces, weights_without_emotion
from usdface.face.bound_face import BoundFace
from usdface.face.drawn_expressions import DRAWN
from usdface.face.expression_poses import EMOTIONS
from usdface.face.full_face_expressions import moves_brows_and_mouth
from usdface.face.mirror import Side, half_weights
from usdface.face.symmetry import symmetric_pairs
from usdface.numerics.ramps import linear_ramp
from usdface.rule_design.movements import single_movements
from usdface.setup.expression import Expression

__all__ = ["Classification", "ExpressionClassifier", "classifiers_of_sides"]

# Tuned by hand on expressions that `benchmarks/drawn_expressions.py` draws, each judged without the
# drawings of its own source; see docs/constants.md.
# Margins of an emotion's score [log odds] to the next emotion and to none: the confidence is 0 up
# to the first number and 1 from the second on.
_MARGIN, _MARGIN_TO_NONE = (4.0, 7.0), (5.0, 11.0)
# Leads of the next emotion, and of none, at which the contradiction begins and is full.
_OTHER_AHEAD, _NONE_AHEAD = (-1.0, 1.0), (2.0, 8.0)
# Cosines with a single movement at which the confidence begins to fall and is 0.
_SINGLE_MOVEMENT = (0.8, 0.9)
# A single movement with at least this cosine to a pose is that expression: a smile is joy. No
# single movement is an expression of brows and mouth.
_SAME = 0.94
# Length of the direction, which is less than 1 of small motion, at which the contradiction begins
# to count and is full.
_CLEAR = (0.6, 0.9)
# Shrinkage of the discriminant: it is to hold on faces that move differently from the synthetic.
_SHRINKAGE = 0.8
# RMS displacement of a coordinate on a human face [m] below which motion is noise, and below which
# its direction decides less and less.
_STILL, _SMALL = 0.00014, 0.0005


@dataclass(frozen=True, eq=False, slots=True)
class Classification:
    """Emotions that a face performs over a take.

    Attributes
    ----------
    confidence : (F, E) float64
        How sure it is that the face performs the emotion and no other, 0 to 1.
    amplitude : (F, E) float64
        Motion along the mean of faces that perform it, relative to the pose, 0 to 1.
    contradiction : (F, E) float64
        How sure it is that the face performs another emotion, or none, 0 to 1.
    """

    confidence: FloatArray
    amplitude: FloatArray
    contradiction: FloatArray

    @property
    def detected(self) -> FloatArray:
        """The amplitude times the confidence of each emotion: (F, E)."""
        return self.confidence * self.amplitude


class ExpressionClassifier:
    """Classifies the motion of a face with M markers as one of some expressions, or none.

    Motion of one side, mirrored to the other, is compared with poses that are mirrored, too, so
    that contempt, a pose of one half, matches its own.

    Parameters
    ----------
    face : BoundFace
    expressions : sequence of Expression
    side : {"both", "left", "right"}
    drawn : collection of str
        Sources of `usdface.face.drawn_expressions`.
    rigs : collection of str, optional
        Of `usdface.face.face_motion`; all of them by default.
    """

    def __init__(
        self,
        face: BoundFace,
        expressions: Sequence[Expression],
        side: Side = "both",
        *,
        drawn: Collection[str] = DRAWN,
        rigs: Collection[str] | None = None,
    ) -> None:
        self._size = face.size
        face = face.at_human_size().with_sorted_shapes()
        pairs = symmetric_pairs(face.shape_names)

        def motion(weights: FloatArray) -> FloatArray:
            own = weights if side == "both" else half_weights(weights, pairs, side)
            return self._relative(face.displacements(own))

        self._count, self._nose = len(expressions), face.nose
        poses = motion(np.array([e.pose(face.shape_names) for e in expressions]))
        single = motion(single_movements(face.shape_names))
        single = single[_lengths(single) > _still(single.shape[1])]
        self._single_movements = (single / _lengths(single)[:, None]).T
        self._rivals = poses / _lengths(poses)[:, None] @ self._single_movements < _SAME
        self._rivals |= [[moves_brows_and_mouth(face, e)] for e in expressions]
        synthetic = synthetic_faces(face, expressions, motion, drawn=drawn, rigs=rigs)
        faces = [_directions(each) for each in synthetic]
        own = _directions(poses)
        none = _directions(motion(weights_without_emotion(face)))
        is_pose = (none @ own.T).max(axis=1, initial=0.0) >= _SAME
        # Of expressions beyond the six no drawing is known: all examples are like the pose.
        narrow = np.array([e.name not in EMOTIONS for e in expressions], dtype=bool)
        self._discriminant = with_room_for_wider_classes(
            _designed([*faces, none[~is_pose]]), own, narrow, _MARGIN[1]
        )
        means = np.array([each.mean(axis=0) for each in faces])
        sizes = np.einsum("ei,ei->e", poses, means)
        self._amplitude = (means / np.maximum(sizes, 1e-12)[:, None]).T

    def _relative(self, moved: FloatArray) -> FloatArray:
        """Return displacements (F, M, 3) relative to the nose tip's: (F, 3 M)."""
        against = (moved - moved[:, self._nose, None]).reshape(len(moved), -1)
        return np.asarray(np.nan_to_num(against, copy=False))

    def classify(self, moved: FloatArray) -> Classification:
        """Classify displacements (F, M, 3) [m]."""
        faces = self._relative(moved) / self._size
        length = _lengths(faces)
        direction = 1.0 / np.hypot(length, _small(faces.shape[1]))[:, None]
        scores = faces @ self._discriminant.directions * direction + self._discriminant.offsets
        clear = linear_ramp(length * direction[:, 0], *_CLEAR)
        still = np.hypot(length, _still(faces.shape[1]))[:, None]
        cosines = faces @ self._single_movements / still
        confidence, contradiction = np.zeros((2, len(faces), self._count))
        for e in range(self._count):
            others = np.delete(scores[:, :-1], e, axis=1) - scores[:, e, None]
            lead = others.max(axis=1, initial=-np.inf)
            rival = cosines[:, self._rivals[e]].max(axis=1, initial=0.0)
            single = linear_ramp(rival, *_SINGLE_MOVEMENT)
            confidence[:, e] = linear_ramp(-lead, *_MARGIN) * (1.0 - single)
            confidence[:, e] *= linear_ramp(scores[:, e] - scores[:, -1], *_MARGIN_TO_NONE)
            none = linear_ramp(scores[:, -1] - scores[:, e], *_NONE_AHEAD)
            contradiction[:, e] = clear * np.maximum(linear_ramp(lead, *_OTHER_AHEAD), none)
        amplitude = np.clip(faces @ self._amplitude, 0.0, 1.0)
        return Classification(confidence, amplitude, contradiction)


def classifiers_of_sides(
    face: BoundFace, expressions: Sequence[Expression], sides: Collection[Side]
) -> Mapping[Side, ExpressionClassifier]:
    """Return each side's classifier; the whole face's where mirroring changes no pose."""
    pairs = symmetric_pairs(face.shape_names)
    poses = np.array([e.pose(face.shape_names) for e in expressions])
    whole = ExpressionClassifier(face, expressions)
    return {
        side: whole
        if side == "both" or np.array_equal(half_weights(poses, pairs, side), poses)
        else ExpressionClassifier(face, expressions, side)
        for side in sides
    }


def _lengths(rows: FloatArray) -> FloatArray:
    """Return the lengths of rows (N, I), at least 1e-12: (N,)."""
    return np.asarray(np.maximum(np.sqrt(np.einsum("ni,ni->n", rows, rows)), 1e-12))


def _still(coordinates: int) -> float:
    """Return the length [m] of the noise in this number of coordinates."""
    return float(_STILL * np.sqrt(coordinates))


def _directions(faces: FloatArray) -> FloatArray:
    """Return coordinates (F, I) divided by their length; small motion is shorter than 1."""
    return np.asarray(faces / np.hypot(_lengths(faces), _small(faces.shape[1]))[:, None])


def _small(coordinates: int) -> float:
    """Return the length [m] in this number of coordinates at which a direction counts by 0.71."""
    return float(_SMALL * np.sqrt(coordinates))


def _designed(classes: Sequence[FloatArray]) -> Discriminant:
    """Return the discriminant of classes of directions (N, I) each."""
    of = np.repeat(np.arange(len(classes)), [len(each) for each in classes])
    return fisher_discriminant(np.concatenate(classes), of, _SHRINKAGE)
