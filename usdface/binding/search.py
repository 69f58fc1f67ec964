"""From every pose a face can have to the few answers that explain the markers best."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from usdface.binding.domain import Domain, domain_of
from usdface.binding.evidence import Evidence
from usdface.binding.register import (
    MOTION_ERROR,
    SHAPE_ERROR,
    Registration,
    against_names,
    improve,
    scale_of,
)
from usdface.binding.skin import Skin
from usdface.retarget.align import similarity_fit
from usdface.takes import FloatArray

__all__ = ["released", "search"]

_ROLLS, _TILTS, _SCALES = range(0, 360, 30), (-25.0, 0.0, 25.0), (0.9, 1.13)
# How many starts, answers and final answers are followed.
_FOLLOWED, _FINAL = 8, 2
_COARSE, _MIDDLE = 0.1, 0.05
# Of the peak frames, how many the starts look at.
_FIRST_PEAKS = 12
# Answers that share more of their places are one.
_SAME = 0.7
# Errors that are tolerated at first: shape [share of the face's size], motion [of the last].
_WIDE, _LOOSE = 0.2, 5.0
_START_STEPS, _STEPS, _LAST_STEPS = 6, 18, 3


def search(skin: Skin, evidence: Evidence) -> tuple[Domain, tuple[Registration, ...]]:
    """Register markers to a skin from many starts.

    Returns
    -------
    Domain
        All of the skin.
    tuple of Registration
        Different answers, the best first.
    """
    anchors = evidence.anchors[evidence.anchors >= 0]
    coarse = domain_of(skin, _COARSE, anchors)
    count, shapes = len(evidence.moves), len(skin.mesh.shapes)
    few = replace(evidence, moves=evidence.moves[:_FIRST_PEAKS], seen=evidence.seen[:_FIRST_PEAKS])
    states = [_state(linear, coarse, few, shapes) for linear in _directions(coarse, evidence)]
    if len(anchors) >= 3 and (known := _anchored(coarse, evidence)) is not None:
        states = [_state(known, coarse, few, shapes)]
    started = [_start(coarse, few, state) for state in states]
    middle = domain_of(skin, _MIDDLE, anchors)
    calm = np.zeros((count, shapes)), np.zeros((count, 6))
    followed = [
        _follow(middle, evidence, replace(state, weights=calm[0], turns=calm[1]))
        for state in _different(started, _FOLLOWED)
    ]
    full = domain_of(skin)
    final = [_finish(full, evidence, state) for state in _different(followed, _FINAL)]
    return full, tuple(_different(final, _FINAL))


def released(skin: Skin, full: Domain, evidence: Evidence, answer: Registration) -> Registration:
    """Return what an answer on all of the skin becomes with other evidence, from nearby."""
    return _finish(full, evidence, _follow(domain_of(skin, _MIDDLE), evidence, answer))


def _directions(domain: Domain, evidence: Evidence) -> list[FloatArray]:
    """Return scaled rotations that bring the flat side of the markers to face the beholder."""
    rest = evidence.rest[evidence.central]
    _, _, axes = np.linalg.svd(rest - rest.mean(axis=0), full_matrices=False)
    axes[2] *= np.linalg.det(axes)
    size = scale_of(domain, evidence)
    found = []
    for flip in (1.0, -1.0):
        upright = axes.T * [1.0, flip, flip]
        for tilt in _TILTS:
            for roll in _ROLLS:
                turned = upright @ _rotation(tilt, roll).T
                found += [scale * size * turned for scale in _SCALES]
    # Where the names say which markers are higher, they say which way up the face is.
    named = [linear for linear in found if against_names(evidence.rest @ linear, evidence) < 1.0]
    return named or found


def _rotation(tilt: float, roll: float) -> FloatArray:
    a, b = np.radians([tilt, roll])
    nod = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
    spin = np.array([[np.cos(b), -np.sin(b), 0], [np.sin(b), np.cos(b), 0], [0, 0, 1]])
    return np.asarray(nod @ spin)


def _anchored(domain: Domain, evidence: Evidence) -> FloatArray | None:
    """Return the scaled rotation that the anchors fix; None where they lie on a line."""
    fixed = evidence.anchors >= 0
    target = domain.points[np.searchsorted(domain.places, evidence.anchors[fixed])]
    source = evidence.rest[fixed]
    for points in (source, target):
        _, lengths, _ = np.linalg.svd(points - points.mean(axis=0))
        if lengths[1] < 0.1 * lengths[0]:
            return None
    return similarity_fit(source, target)[0]


def _state(linear: FloatArray, domain: Domain, evidence: Evidence, shapes: int) -> Registration:
    markers, count = len(evidence.rest), len(evidence.moves)
    fixed = evidence.anchors >= 0
    if fixed.any():
        middle = domain.points[np.searchsorted(domain.places, evidence.anchors[fixed])].mean(axis=0)
        offset = middle - evidence.rest[fixed].mean(axis=0) @ linear
    else:
        offset = -evidence.rest[evidence.moving].mean(axis=0) @ linear
    return Registration(
        linear,
        offset,
        np.zeros((markers, 3)),
        np.zeros((count, shapes)),
        np.zeros((count, 6)),
        np.zeros(markers, dtype=np.int64),
        np.zeros(markers),
        np.inf,
    )


def _start(domain: Domain, evidence: Evidence, state: Registration) -> Registration:
    for step, error in enumerate(np.geomspace(_WIDE, 0.7 * _WIDE, _START_STEPS)):
        # Without weights the rig stands still, and motion says nothing.
        motion = np.inf if step < 2 else MOTION_ERROR
        state = improve(domain, evidence, state, error, motion, soft=False, rough=True)
    return state


def _follow(domain: Domain, evidence: Evidence, state: Registration) -> Registration:
    errors = np.geomspace(_WIDE, SHAPE_ERROR, _STEPS)
    motions = MOTION_ERROR * np.geomspace(_LOOSE, 1.0, _STEPS)
    for error, motion in zip(errors, motions, strict=True):
        state = improve(domain, evidence, state, error, motion)
    return _finish(domain, evidence, state)


def _finish(domain: Domain, evidence: Evidence, state: Registration) -> Registration:
    for _ in range(_LAST_STEPS):
        state = improve(domain, evidence, state, soft=False)
    return state


def _different(states: Sequence[Registration], count: int) -> list[Registration]:
    """Return the best answers that are not nearly the same."""
    best: list[Registration] = []
    for state in sorted(states, key=lambda state: state.cost):
        if len(best) < count and all(
            (state.places == other.places).mean() <= _SAME for other in best
        ):
            best.append(state)
    return best
