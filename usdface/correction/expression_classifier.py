"""Likeness: how far the motion of a face is that of an expression.

Rules detect an emotion from a few markers, as far as they move as in the character's own pose.
Another person's brows and lips move otherwise: the right rule is mostly the strongest, but weak. So
all markers together are compared with synthetic faces of every expression: as people and artists
draw it (`usdface.face.drawn_expressions`), in the directions in which the character and other rigs
move for each action unit (`usdface.face.face_motion`). A linear discriminant of these and of
movements without meaning classifies the emotion of a face, or none. Where another emotion is as
near, the rule is silenced. Both are continuous in the markers.
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
from usdface.face.both_halves import shown_by_both_halves
from usdface.face.bound_face import BoundFace
from usdface.face.drawn_expressions import DRAWN
from usdface.face.expression_poses import EMOTIONS
from usdface.face.mirror import Side, half_weights
from usdface.face.symmetry import symmetric_pairs
from usdface.numerics.ramps import linear_ramp
from usdface.rule_design.movements import single_movements
from usdface.setup.expression import Expression

__all__ = ["ExpressionLikeness", "Likeness", "likeness_of_sides", "performers_outputs"]

# Tuned by hand on expressions that `benchmarks/drawn_expressions.py` shows, each judged without the
# drawings of its own source; see docs/constants.md.
# By how much the score of an emotion has to be ahead of all others (log odds) and of no emotion,
# from where that of another emotion silences a rule, and how like a movement alone (cosine) a face
# may be at most.
_AHEAD = (4.0, 7.0)
_SOMETHING = (5.0, 11.0)
_CONTRARY = (-1.0, 1.0)
# The same of no emotion.
_NOTHING = (2.0, 8.0)
_ALONE = (0.8, 0.9)
# Motion so small, by its length and that below which its direction is doubtful, silences nothing.
_CLEAR = (0.6, 0.9)
# A movement alone that is as like a pose as this means something: a smile is joy. None is where
# an expression has brows and a mouth.
_SAME = 0.94
# Shrinkage of the discriminant: it is to hold on faces that move otherwise than these.
_SHRINKAGE = 0.8
# Likeness alone is an output of at most so much. A performer who shows less than the second at most
# is heard in proportion, so many times as strong.
_MOST, _USUAL, _WEAKEST = 0.5, 0.45, 2.0
# RMS displacement of a coordinate on a human face [m] below which motion is noise, and below which
# its direction decides less and less.
_STILL, _SMALL = 0.00014, 0.0005


@dataclass(frozen=True, eq=False, slots=True)
class Likeness:
    """How far each emotion is shown over a take.

    Attributes
    ----------
    certain : (F, E) float64
        How far the face shows it, and no other emotion, 0 to 1.
    size : (F, E) float64
        How far it moves along the mean of faces that show it, relative to the pose, 0 to 1.
    contrary : (F, E) float64
        How far the face is more like another emotion, or none, 0 to 1.
    """

    certain: FloatArray
    size: FloatArray
    contrary: FloatArray

    @property
    def shown(self) -> FloatArray:
        """The size of each expression as far as it is certain: (F, E)."""
        return self.certain * self.size


class ExpressionLikeness:
    """Classifies the motion of a face with M markers by some expressions.

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

        def shown(weights: FloatArray) -> FloatArray:
            own = weights if side == "both" else half_weights(weights, pairs, side)
            return self._relative(face.displacements(own))

        self._count, self._nose = len(expressions), face.nose
        poses = shown(np.array([e.pose(face.shape_names) for e in expressions]))
        alone = shown(single_movements(face.shape_names))
        alone = alone[_lengths(alone) > _still(alone.shape[1])]
        self._alone = (alone / _lengths(alone)[:, None]).T
        self._rivals = poses / _lengths(poses)[:, None] @ self._alone < _SAME
        self._rivals |= [[shown_by_both_halves(face, e)] for e in expressions]
        made = synthetic_faces(face, expressions, shown, drawn=drawn, rigs=rigs)
        faces = [_directions(each) for each in made]
        own = _directions(poses)
        nothing = _directions(shown(weights_without_emotion(face)))
        meaning = (nothing @ own.T).max(axis=1, initial=0.0) >= _SAME
        # Of expressions beyond the six no drawing is known: all examples are like the pose.
        narrow = np.array([e.name not in EMOTIONS for e in expressions], dtype=bool)
        self._discriminant = with_room_for_wider_classes(
            _designed([*faces, nothing[~meaning]]), own, narrow, _AHEAD[1]
        )
        middle = np.array([each.mean(axis=0) for each in faces])
        sizes = np.einsum("ei,ei->e", poses, middle)
        self._along = (middle / np.maximum(sizes, 1e-12)[:, None]).T

    def _relative(self, moved: FloatArray) -> FloatArray:
        """Return displacements (F, M, 3) relative to the nose tip's: (F, 3 M)."""
        against = (moved - moved[:, self._nose, None]).reshape(len(moved), -1)
        return np.asarray(np.nan_to_num(against, copy=False))

    def of(self, moved: FloatArray) -> Likeness:
        """Judge displacements (F, M, 3) [m]."""
        faces = self._relative(moved) / self._size
        length = _lengths(faces)
        direction = 1.0 / np.hypot(length, _small(faces.shape[1]))[:, None]
        scores = faces @ self._discriminant.directions * direction + self._discriminant.offsets
        clear = linear_ramp(length * direction[:, 0], *_CLEAR)
        alone = faces @ self._alone / np.hypot(length, _still(faces.shape[1]))[:, None]
        certain, contrary = np.zeros((2, len(faces), self._count))
        for e in range(self._count):
            others = np.delete(scores[:, :-1], e, axis=1) - scores[:, e, None]
            other = others.max(axis=1, initial=-np.inf)
            rival = alone[:, self._rivals[e]].max(axis=1, initial=0.0)
            certain[:, e] = linear_ramp(-other, *_AHEAD) * (1.0 - linear_ramp(rival, *_ALONE))
            certain[:, e] *= linear_ramp(scores[:, e] - scores[:, -1], *_SOMETHING)
            nothing = linear_ramp(scores[:, -1] - scores[:, e], *_NOTHING)
            contrary[:, e] = clear * np.maximum(linear_ramp(other, *_CONTRARY), nothing)
        return Likeness(certain, np.clip(faces @ self._along, 0.0, 1.0), contrary)


def likeness_of_sides(
    face: BoundFace, expressions: Sequence[Expression], sides: Collection[Side]
) -> Mapping[Side, ExpressionLikeness]:
    """Return each side's likeness; the whole face's for those where mirroring changes no pose."""
    pairs = symmetric_pairs(face.shape_names)
    poses = np.array([e.pose(face.shape_names) for e in expressions])
    whole = ExpressionLikeness(face, expressions)
    return {
        side: whole
        if side == "both" or np.array_equal(half_weights(poses, pairs, side), poses)
        else ExpressionLikeness(face, expressions, side)
        for side in sides
    }


def performers_outputs(
    outputs: FloatArray,
    likeness: Likeness,
    weights: FloatArray,
    strength: FloatArray,
    silencing: float = 1.0,
) -> FloatArray:
    """Return the outputs (F, E) of rules, combined with the likeness of the face.

    Parameters
    ----------
    outputs : (F, E) float64
    likeness : Likeness
    weights : (E,) float64
        How far likeness to each emotion counts, 0 to 1.
    strength : (E,) float64
        The largest output or `Likeness.shown` of each emotion over the take: for a performer who
        shows less than about a half of the character's pose, sizes are scaled up in proportion, not
        the certainty.
    silencing : float
        How far likeness to another emotion silences a rule, 0 to 1.
    """
    gain = np.clip(_USUAL / np.maximum(strength, 1e-12), 1.0, _WEAKEST)
    shown = np.minimum(likeness.certain * np.minimum(gain * likeness.size, 1.0), _MOST)
    return np.maximum(outputs * (1.0 - silencing * likeness.contrary), weights * shown)


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
