"""Likeness: how far the motion of a face is that of an expression or of one of its variants.

Rules hear an emotion by a few markers, as far as they move as in the character's own pose. Another
person's brows and lips go elsewhere: the right rule is mostly the strongest, but weak. So all
markers together are compared with the variants of every expression that the character can show
(`usdface.face.expression_variants`). Which emotion they are of is told by a linear discriminant of
faces that are made up from variants, and of movements that mean none; a face that is like none of
the variants shows no emotion. Where another emotion is as near, the rule is not believed. Both are
continuous in the markers.
"""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass

import numpy as np

from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.correction.discriminant import Discriminant, fisher_discriminant
from usdface.face.both_halves import shown_by_both_halves
from usdface.face.bound_face import BoundFace
from usdface.face.drawn_expressions import DRAWN
from usdface.face.expression_variants import Variant, expression_variants
from usdface.face.mirror import Side, half_weights
from usdface.face.symmetry import symmetric_pairs
from usdface.retarget_setup import Expression
from usdface.rule_design.movements import movements, single_movements

__all__ = ["ExpressionLikeness", "Likeness", "performers_outputs"]

# Tuned by hand on expressions that `benchmarks/drawn_expressions.py` shows, each judged without the
# variants of its own source; see docs/constants.md.
# Likeness (cosine) from which a variant begins to count and counts whole, by how much more it has
# to be than that of any movement alone, by how much the score of the emotion has to be ahead of all
# others, and from where that of another emotion silences a rule.
_LIKE = (0.75, 0.85)
_MARGIN = (0.0, 0.08)
_AHEAD = (6.0, 12.0)
_CONTRARY = (0.0, 3.0)
# Motion so small, by its length and that below which its direction is doubtful, silences nothing.
_CLEAR = (0.6, 0.9)
# Either half of the face in which a variant moves by this share has to be like it, too.
_HALF_MOVES, _HALF_LIKE = 0.3, (0.4, 0.6)
# A movement alone that is as like a pose as this means something: a smile is joy. None is where
# an expression has brows and a mouth.
_SAME = 0.94
# Faces made up for each emotion: so many, from its variants and so many times its pose, every blend
# shape that much stronger or weaker, and one movement of at most so much more.
_DRAWS, _OWN_POSE, _STRENGTH, _MORE = 200, 4, (0.4, 1.1), 0.3
_SEED = 11
# Shrinkage of the discriminant: it is to hold on faces that move otherwise than the character.
_SHRINKAGE = 0.8
# Likeness alone is an output of at most so much. A performer who shows less than that is heard so
# many times as strong, at most.
_MOST, _WEAKEST = 0.45, 2.0
# RMS displacement of a coordinate [m] below which motion is noise, and below which its direction
# decides less and less.
_STILL, _SMALL = 0.00014, 0.0005


@dataclass(frozen=True, eq=False, slots=True)
class Likeness:
    """How far each emotion is shown over a take.

    Attributes
    ----------
    certain : (F, E) float64
        How far the face is like a variant, and like no other emotion's, 0 to 1.
    size : (F, E) float64
        How far it moves along this variant, by the size of the pose, 0 to 1.
    contrary : (F, E) float64
        How far the face is more like another emotion, 0 to 1.
    """

    certain: FloatArray
    size: FloatArray
    contrary: FloatArray

    @property
    def shown(self) -> FloatArray:
        """The size of each expression as far as it is certain: (F, E)."""
        return self.certain * self.size


class ExpressionLikeness:
    """Judges motion by the variants of some expressions on a face with M markers.

    That of one side, mirrored to the other, is judged by variants that are mirrored, too: contempt,
    a pose of one half, is like itself then. `drawn` are sources of
    `usdface.face.drawn_expressions`.
    """

    def __init__(
        self,
        face: BoundFace,
        expressions: Sequence[Expression],
        side: Side = "both",
        drawn: Collection[str] = DRAWN,
    ) -> None:
        variants = expression_variants(expressions, face.shape_names, drawn)
        pairs = symmetric_pairs(face.shape_names)

        def shown(weights: FloatArray) -> FloatArray:
            own = weights if side == "both" else half_weights(weights, pairs, side)
            return self._relative(face.displacements(own))

        names = [expression.name for expression in expressions]
        self._emotion: IntArray = np.array([names.index(v.emotion) for v in variants])
        self._count, self._nose = len(names), face.nose
        moved = shown(np.array([v.weights for v in variants]))
        upper = np.repeat(face.neutral[:, 1] > face.neutral[self._nose, 1], 3)
        self._sizes = _lengths(moved)
        self._halves: list[tuple[BoolArray, FloatArray, FloatArray, BoolArray]] = []
        for half in (upper, ~upper):
            sizes = _lengths(moved[:, half])
            self._halves.append((half, moved[:, half].T, sizes, sizes >= _HALF_MOVES * self._sizes))
        poses = moved[: self._count] / self._sizes[: self._count, None]
        alone = shown(single_movements(face.shape_names))
        alone = alone[_lengths(alone) > _still(alone.shape[1])]
        self._alone = (alone / _lengths(alone)[:, None]).T
        self._rivals = poses @ self._alone < _SAME
        self._rivals |= [[shown_by_both_halves(face, e)] for e in expressions]
        self._discriminant = self._designed(face, variants, shown)

    def _relative(self, moved: FloatArray) -> FloatArray:
        """Return displacements (F, M, 3) against the nose tip: (F, 3 M)."""
        against = moved - moved[:, self._nose, None]
        return np.asarray(np.nan_to_num(against).reshape(len(moved), -1))

    def _designed(
        self,
        face: BoundFace,
        variants: Sequence[Variant],
        shown: Callable[[FloatArray], FloatArray],
    ) -> Discriminant:
        """Return the discriminant of the expressions and, as the last class, of no emotion."""
        rng = np.random.default_rng(_SEED)
        alone = single_movements(face.shape_names)
        made = []
        for e in range(self._count):
            own = [v for v, k in zip(variants, self._emotion, strict=True) if k == e]
            own = [v for v in own if v.source != "FACS"] + [own[0]] * (_OWN_POSE - 1)
            rows = np.array([v.weights for v in own])[rng.integers(len(own), size=_DRAWS)]
            rows = rows * rng.uniform(*_STRENGTH, size=rows.shape)
            more = (
                _MORE * rng.uniform(size=(_DRAWS, 1)) * alone[rng.integers(len(alone), size=_DRAWS)]
            )
            made.append(np.clip(rows + more, 0.0, 1.0))
        poses = _directions(shown(np.array([v.weights for v in variants[: self._count]])))
        known = movements(face.shape_names)
        rest = np.zeros((1, len(face.shape_names)))
        nothing = _directions(shown(np.concatenate([rest, known.single, known.mixed])))
        meaning = (nothing @ poses.T).max(axis=1, initial=0.0) >= _SAME
        faces = np.concatenate([_directions(shown(np.concatenate(made))), nothing[~meaning]])
        classes = np.full(len(faces), self._count)
        classes[: _DRAWS * self._count] = np.repeat(np.arange(self._count), _DRAWS)
        return fisher_discriminant(faces, classes, _SHRINKAGE)

    def of(self, moved: FloatArray) -> Likeness:
        """Judge displacements (F, M, 3) [m]."""
        return Likeness(*self._judge(self._relative(moved)))

    def _judge(self, faces: FloatArray) -> FloatArray:
        """Judge coordinates (F, 3 M): the fields of `Likeness`, (3, F, E)."""
        length = np.sqrt(_lengths(faces) ** 2 + _still(faces.shape[1]) ** 2)[:, None]
        along, there = np.zeros((2, len(faces), len(self._sizes)))
        there += 1.0
        for half, variants, sizes, moves in self._halves:
            own = faces[:, half]
            common = own @ variants
            reach = np.sqrt(_lengths(own) ** 2 + _still(own.shape[1]) ** 2)[:, None]
            likeness = common / (reach * sizes)
            there *= np.where(moves, _ramp(likeness, _HALF_LIKE), 1.0)
            along += common / self._sizes
        like, alone = along / length, faces @ self._alone / length
        directions = _directions(faces)
        scores = self._discriminant.scores(directions)
        clear = _ramp(np.linalg.norm(directions, axis=1), _CLEAR)
        found, rows = np.zeros((3, len(faces), self._count)), np.arange(len(faces))
        for e in range(self._count):
            own_variants = self._emotion == e
            share = np.clip(along[:, own_variants] / self._sizes[e], 0.0, 1.0)
            rival = alone[:, self._rivals[e]].max(axis=1, initial=0.0)[:, None]
            own = like[:, own_variants]
            certain = _ramp(own, _LIKE) * _ramp(own - rival, _MARGIN) * there[:, own_variants]
            chosen = (certain * share).argmax(axis=1)
            others = np.delete(scores, e, axis=1) - scores[:, e, None]
            ahead = _ramp(-others.max(axis=1), _AHEAD)
            contrary = clear * _ramp(others[:, :-1].max(axis=1, initial=-np.inf), _CONTRARY)
            found[:, :, e] = ahead * certain[rows, chosen], share[rows, chosen], contrary
        return found


def performers_outputs(
    outputs: FloatArray,
    likeness: Likeness,
    weights: FloatArray,
    strength: FloatArray,
    silencing: float = 1.0,
) -> FloatArray:
    """Return the outputs (F, E) of rules together with the likeness of the face.

    Parameters
    ----------
    outputs : (F, E) float64
    likeness : Likeness
    weights : (E,) float64
        How far likeness to each emotion counts, 0 to 1.
    strength : (E,) float64
        The largest `Likeness.shown` of each emotion over the take: a performer who shows less than
        a half of the character's pose is read in proportion to that. Sizes are larger then, no
        likeness is more certain.
    silencing : float
        How far likeness to another emotion silences a rule, 0 to 1.
    """
    gain = np.clip(_MOST / np.maximum(strength, 1e-12), 1.0, _WEAKEST)
    shown = np.minimum(likeness.certain * np.minimum(gain * likeness.size, 1.0), _MOST)
    return np.maximum(outputs * (1.0 - silencing * likeness.contrary), weights * shown)


def _lengths(rows: FloatArray) -> FloatArray:
    """Return the lengths of rows (N, I), at least a numerical trace: (N,)."""
    return np.asarray(np.maximum(np.linalg.norm(rows, axis=1), 1e-12))


def _still(coordinates: int) -> float:
    """Return the length of the noise of so many coordinates [m]."""
    return float(_STILL * np.sqrt(coordinates))


def _directions(faces: FloatArray) -> FloatArray:
    """Return coordinates (F, I) by their length; small motion is less than 1."""
    small = _SMALL * np.sqrt(faces.shape[1])
    return np.asarray(faces / np.sqrt(np.square(faces).sum(axis=1, keepdims=True) + small**2))


def _ramp(x: FloatArray, ends: tuple[float, float]) -> FloatArray:
    return np.asarray(np.clip((x - ends[0]) / (ends[1] - ends[0]), 0.0, 1.0))
