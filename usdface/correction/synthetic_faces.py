"""Synthetic faces of each expression, and of none: training examples of a discriminant.

They vary the strengths of the expression's shapes and the rig that performs them, and add a jaw
that drops in speech and eyes that close in a blink. Each is drawn with its mirror image. What is
drawn depends on no blend shape that moves no marker, and the strength of a blend shape or an action
unit on its own name alone.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from zlib import crc32

import numpy as np

from usdface.arrays import FloatArray, IntArray
from usdface.face.bound_face import BoundFace
from usdface.face.drawn_expressions import DRAWN
from usdface.face.expression_poses import EMOTIONS, composed_pose
from usdface.face.expression_variants import expression_variants
from usdface.face.face_motion import motion_at
from usdface.face.plain_names import shape_keys
from usdface.face.symmetry import mirrored_pairs
from usdface.rule_design.movements import (
    in_columns,
    mixed_movements,
    moving_shapes,
    single_movements,
)
from usdface.setup.expression import Expression

__all__ = ["synthetic_faces", "weights_without_emotion"]

# FACS: 64 is eyes that look down, which is no expression.
_GLANCE = 64
# Faces for each expression by the character's own blend shapes, and by action units in the
# directions of several rigs; mixtures of movements without emotion, and the part of these for which
# each movement alone counts once.
_OWN, _OTHERS, _MIXED, _ALONE = 400, 1200, 1600, 400
# Number of drawings that the pose counts for; range of factors on each blend shape or unit; largest
# strength of the one movement added.
_AS_DRAWN, _STRENGTH, _MORE = 8, (0.4, 1.1), 0.3
# Share of the faces in which the jaw drops by up to so much, and of those whose eyes close.
_JAW, _DROPPED, _CLOSED = 0.5, 0.8, 0.3
_SEED = 11
_CoordinatesOf = Callable[[FloatArray], FloatArray]


def synthetic_faces(
    face: BoundFace,
    expressions: Sequence[Expression],
    coordinates_of: _CoordinatesOf,
    *,
    drawn: Collection[str],
    rigs: Collection[str] | None,
) -> list[FloatArray]:
    """Return faces (N, 3 M) for each expression, displacements against the nose tip [m].

    Parameters
    ----------
    face : BoundFace
    expressions : sequence of Expression
    coordinates_of : callable
        Returns the coordinates (F, 3 M) of weights (F, S).
    drawn : collection of str
        Sources of `DRAWN`.
    rigs : collection of str, optional
        Of `usdface.face.face_motion`; None = all of them.
    """
    variants = expression_variants(expressions, face.shape_names, drawn)
    names, mirror = face.shape_names, _mirror(face.shape_names)
    alone = _alone(face)
    factors = _factors(["".join(key) for key in shape_keys(names)], len(expressions), _OWN // 2)
    nuisances = [_unit(face, number) for number in (26, 43)]
    motion = _motion_of_units(face, coordinates_of, rigs)
    units = () if motion is None else motion[0]
    unit_factors = _factors([str(unit) for unit in units], len(expressions), _OTHERS)
    made = []
    for expression, own_factors, others in zip(expressions, factors, unit_factors, strict=True):
        rng = _generator(expression.name)
        own = [v for v in variants if v.emotion == expression.name]
        poses = np.array([v.weights for v in own + own[:1] * (_AS_DRAWN - 1)])
        faces = [coordinates_of(_varied(rng, poses, alone, nuisances, own_factors, mirror))]
        if motion is not None and expression.name in EMOTIONS:
            moved = motion[1]
            drawings = [_strengths(EMOTIONS[expression.name], units)] * _AS_DRAWN
            for source in drawn:
                known = (shares for name, shares in DRAWN[source] if name == expression.name)
                drawings += [_strengths(shares, units) for shares in known]
            each = np.eye(len(units))
            lids_and_jaw = [_strengths({number: 1.0}, units) for number in (26, 43)]
            strengths = _varied(rng, np.array(drawings), each, lids_and_jaw, others)
            of = np.stack([_evenly(rng, len(moved), len(strengths)) for _ in units], axis=1)
            by_rig = np.concatenate([(of == k) * strengths for k in range(len(moved))], axis=1)
            faces.append(by_rig @ moved.reshape(by_rig.shape[1], -1))
        made.append(np.concatenate(faces))
    return made


def weights_without_emotion(face: BoundFace) -> FloatArray:
    """Return weights (N, S) of no emotion: rest, single blend shapes, mixtures of them."""
    moving, columns = moving_shapes(face)
    single = np.concatenate([np.zeros((1, len(columns))), _alone(face)])
    mixed = in_columns(mixed_movements(moving, _MIXED // 2, _generator("mixed")), columns)
    mixed = np.concatenate([mixed, mixed[:, _mirror(face.shape_names)]])
    return np.concatenate([np.repeat(single, max(len(mixed) // _ALONE, 1), axis=0), mixed])


def _alone(face: BoundFace) -> FloatArray:
    """Return the single movements of the blend shapes that move a marker: (N, S)."""
    moving, columns = moving_shapes(face)
    return in_columns(single_movements(moving), columns)


def _varied(
    rng: np.random.Generator,
    drawings: FloatArray,
    more: FloatArray,
    jaw_and_lids: Sequence[FloatArray],
    factors: FloatArray,
    mirror: IntArray | None = None,
) -> FloatArray:
    """Return random variations of drawings (D, S), each with a movement added: (N, S).

    By factors (N, S), 0 to 1, and where columns have a `mirror` (S,) by as many mirrored ones.
    """
    count, added = len(factors), np.zeros_like(factors)
    drawn = _evenly(rng, len(drawings), count)
    if len(more):
        added = _MORE * rng.uniform(size=(count, 1)) * more[_evenly(rng, len(more), count)]
    least, closed = np.zeros_like(factors), ((_JAW, _DROPPED), (_CLOSED, 1.0))
    for (share, most), moved in zip(closed, jaw_and_lids, strict=True):
        at = (_evenly(rng, count, count) + rng.uniform(size=count)) / count
        there = most * np.clip(1.0 - at / share, 0.0, None)
        least = np.maximum(least, there[:, None] * moved)
    if mirror is not None:
        factors, added = (np.concatenate([each, each[:, mirror]]) for each in (factors, added))
        drawn, least = np.tile(drawn, 2), np.tile(least, (2, 1))
    weakest, strongest = _STRENGTH
    rows = drawings[drawn] * (weakest + (strongest - weakest) * factors) + added
    return np.clip(np.maximum(rows, least), 0.0, 1.0)


def _evenly(rng: np.random.Generator, kinds: int, count: int) -> IntArray:
    """Return `count` numbers below `kinds` in random order, each as often as the others."""
    return rng.permutation(np.arange(count) % kinds)


def _factors(names: Sequence[str], rows: int, count: int) -> FloatArray:
    """Return random numbers from 0 to 1 that belong to names: (rows, count, len(names)).

    Those of each name and row lie evenly (Latin hypercube: McKay, Beckman and Conover 1979).
    """
    factors = np.zeros((rows, count, len(names)))
    for column, name in enumerate(names):
        rng = _generator(name)
        order = rng.permuted(np.tile(np.arange(count), (rows, 1)), axis=1)
        factors[..., column] = (order + rng.uniform(size=order.shape)) / count
    return factors


def _generator(name: str) -> np.random.Generator:
    return np.random.default_rng([_SEED, crc32(name.encode())])


def _mirror(names: tuple[str, ...]) -> IntArray:
    """Return the counterpart of each blend shape on the other side, by name: (S,)."""
    mirror, pairs = np.arange(len(names)), mirrored_pairs(names)
    mirror[pairs] = pairs[:, ::-1]
    return mirror


def _motion_of_units(
    face: BoundFace, coordinates_of: _CoordinatesOf, rigs: Collection[str] | None
) -> tuple[tuple[int, ...], FloatArray] | None:
    """Return action units and their displacements on R rigs, the character first: (R, U, 3 M) [m].

    A rig without a unit gets the mean of the others. None where no other rig's motion is known.
    """
    others = motion_at(face, rigs)
    if not others:
        return None
    units = tuple(sorted(set().union(*others.values()) - {_GLANCE}))
    moved = np.full((1 + len(others), len(units), 3 * len(face.markers)), np.nan)
    for column, unit in enumerate(units):
        if (own := _unit(face, unit)).any():
            moved[0, column] = coordinates_of(own[None])[0]
        for rig, known in enumerate(others.values(), start=1):
            if unit in known:
                moved[rig, column] = (known[unit] - known[unit][face.nose]).ravel()
    there = ~np.isnan(moved)
    mean = np.where(there, moved, 0.0).sum(axis=0) / there.sum(axis=0)
    return units, np.where(there, moved, mean)


def _unit(face: BoundFace, number: int) -> FloatArray:
    """Return the weights (S,) of an action unit; 0 where the rig has none."""
    pose = composed_pose({number: 1.0}, face.shape_names)
    return np.zeros(len(face.shape_names)) if pose is None else pose.pose(face.shape_names)


def _strengths(shares: Mapping[int, float], units: Sequence[int]) -> FloatArray:
    return np.array([shares.get(unit, 0.0) for unit in units])
