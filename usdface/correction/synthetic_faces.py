"""Synthetic faces of each expression, and of none: training examples of a discriminant.

They vary the strengths of the expression's shapes and the rig that performs them, and add a jaw
that drops in speech and eyes that close in a blink.
"""

from collections.abc import Callable, Collection, Mapping, Sequence

import numpy as np

from usdface.arrays import FloatArray
from usdface.face.bound_face import BoundFace
from usdface.face.drawn_expressions import DRAWN
from usdface.face.expression_poses import EMOTIONS, composed_pose
from usdface.face.expression_variants import expression_variants
from usdface.face.face_motion import motion_at
from usdface.rule_design.movements import movements, single_movements
from usdface.setup.expression import Expression

__all__ = ["synthetic_faces", "weights_without_emotion"]

# FACS: 64 is eyes that look down, which is no expression.
_GLANCE = 64
# Faces for each expression by the character's own blend shapes, and by action units in the
# directions of several rigs.
_OWN, _OTHERS = 100, 300
# Number of drawings that the pose counts for; range of factors on each blend shape or unit; largest
# strength of the one movement added.
_AS_DRAWN, _STRENGTH, _MORE = 8, (0.4, 1.1), 0.3
# Share of the faces in which the jaw drops by up to so much, and of those whose eyes close.
_JAW, _DROPPED, _CLOSED = 0.5, 0.8, 0.3
_SEED = 11
_Shown = Callable[[FloatArray], FloatArray]


def synthetic_faces(
    face: BoundFace,
    expressions: Sequence[Expression],
    shown: _Shown,
    *,
    drawn: Collection[str],
    rigs: Collection[str] | None = None,
) -> list[FloatArray]:
    """Return faces (N, 3 M) for each expression, displacements against the nose tip [m].

    Parameters
    ----------
    face : BoundFace
    expressions : sequence of Expression
    shown : callable
        Returns the coordinates (F, 3 M) of weights (F, S).
    drawn : collection of str
        Sources of `DRAWN`.
    rigs : collection of str, optional
        Of `usdface.face.face_motion`; all of them by default.
    """
    rng = np.random.default_rng(_SEED)
    variants = expression_variants(expressions, face.shape_names, drawn)
    alone = single_movements(face.shape_names)
    nuisances = [_unit(face, number) for number in (26, 43)]
    motion = _motion_of_units(face, shown, rigs)
    made = []
    for expression in expressions:
        own = [v for v in variants if v.emotion == expression.name]
        poses = np.array([v.weights for v in own + own[:1] * (_AS_DRAWN - 1)])
        faces = [shown(_varied(rng, poses, alone, nuisances, _OWN))]
        if motion is not None and expression.name in EMOTIONS:
            units, moved = motion
            drawings = [_strengths(EMOTIONS[expression.name], units)] * _AS_DRAWN
            for source in drawn:
                known = (shares for name, shares in DRAWN[source] if name == expression.name)
                drawings += [_strengths(shares, units) for shares in known]
            each = np.eye(len(units))
            lids_and_jaw = [_strengths({number: 1.0}, units) for number in (26, 43)]
            strengths = _varied(rng, np.array(drawings), each, lids_and_jaw, _OTHERS)
            of = rng.integers(len(moved), size=strengths.shape)
            by_rig = np.concatenate([(of == k) * strengths for k in range(len(moved))], axis=1)
            faces.append(by_rig @ moved.reshape(by_rig.shape[1], -1))
        made.append(np.concatenate(faces))
    return made


def weights_without_emotion(shape_names: tuple[str, ...]) -> FloatArray:
    """Return weights (N, S) of no emotion: rest, single blend shapes, mixtures of them."""
    known = movements(shape_names)
    return np.concatenate([np.zeros((1, len(shape_names))), known.single, known.mixed])


def _varied(
    rng: np.random.Generator,
    drawings: FloatArray,
    more: FloatArray,
    jaw_and_lids: Sequence[FloatArray],
    count: int,
) -> FloatArray:
    """Return random variations of drawings (D, S), each with a movement added: (count, S)."""
    rows = drawings[rng.integers(len(drawings), size=count)]
    rows = rows * rng.uniform(*_STRENGTH, size=rows.shape)
    rows += _MORE * rng.uniform(size=(count, 1)) * more[rng.integers(len(more), size=count)]
    limits = ((_JAW, _DROPPED), (_CLOSED, 1.0))
    for (share, most), moved in zip(limits, jaw_and_lids, strict=True):
        there = (rng.uniform(size=count) < share) * rng.uniform(0.0, most, size=count)
        rows = np.maximum(rows, there[:, None] * moved)
    return np.clip(rows, 0.0, 1.0)


def _motion_of_units(
    face: BoundFace, shown: _Shown, rigs: Collection[str] | None
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
            moved[0, column] = shown(own[None])[0]
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
