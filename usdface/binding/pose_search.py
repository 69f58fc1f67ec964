"""Global search for the registration: starts at all head poses, refinement of the best ones."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from usdface.arrays import FloatArray
from usdface.binding.alignment import align, name_disagreement
from usdface.binding.candidates import CandidateVertices, candidate_vertices
from usdface.binding.face_surface import FaceSurface
from usdface.binding.observations import Observations
from usdface.binding.registration import (
    MOTION_ERROR,
    SHAPE_ERROR,
    Registration,
    expected_scale,
)
from usdface.geometry.rigid_fit import similarity_fit

__all__ = ["RegisteredMarkers", "refine", "register_from", "search_pose"]

# Numbers without another source were set by hand; judge: `python benchmarks/binding.py`;
# docs/constants.md lists them.

# Poses of the starts: rotations [degrees], and scales about the expected one, whose logarithms are
# within a deviation of it (`alignment._SPREAD`).
_ROLLS, _TILTS, _SCALES = range(0, 360, 30), (-25.0, 0.0, 25.0), (0.9, 1.13)
# How many starts, and then registrations, are followed.
_FOLLOWED, _FINAL = 8, 2
# Cells of the face that is decimated for the start poses [share of its size].
_COARSE = 0.1
# Peak frames that the starts use; they are ordered, the most different ones first.
_FIRST_PEAKS = 12
# Registrations that share more of their vertices are one.
_SAME = 0.7
# Expected errors at first: of shape [share of the face's size], of motion [multiple of the last].
_FIRST_SHAPE_ERROR, _FIRST_MOTION_ERROR = 0.2, 5.0
# Steps of the registration, from the first errors to the last: of a start, of one that is followed,
# and at the end.
_START_STEPS, _STEPS, _LAST_STEPS = 6, 18, 3
# Share of its first error down to which a start anneals.
_START_ANNEALED = 0.7
# Starts that keep weights at 0: there the rig does not move, and motion is no evidence.
_WITHOUT_MOTION = 2
# Anchors lie on a line where their second singular value is below this share of the first: then
# they leave a turn open.
_LINE = 0.1


@dataclass(frozen=True, eq=False, slots=True)
class RegisteredMarkers:
    """Observed markers, their candidates on a face, and the registrations between them.

    Attributes
    ----------
    candidates : CandidateVertices
        All vertices of the face surface.
    observations : Observations
    registrations : tuple of Registration
        Different ones, the best first; one at least.
    """

    candidates: CandidateVertices
    observations: Observations
    registrations: tuple[Registration, ...]

    @property
    def best(self) -> Registration:
        """The registration of least cost."""
        return self.registrations[0]


def search_pose(surface: FaceSurface, observations: Observations) -> RegisteredMarkers:
    """Register markers to a face from many starts."""
    anchors = observations.anchors[observations.anchored]
    coarse = candidate_vertices(surface, _COARSE, anchors)
    count, shapes = len(observations.displacements), len(surface.mesh.shapes)
    few = replace(
        observations,
        displacements=observations.displacements[:_FIRST_PEAKS],
        visible=observations.visible[:_FIRST_PEAKS],
    )
    linears = _start_poses(coarse, observations)
    if len(anchors) >= 3 and (known := _anchored_pose(coarse, observations)) is not None:
        linears = [known]
    started = [_start(coarse, few, _initial(linear, coarse, few)) for linear in linears]
    full = candidate_vertices(surface)
    still = np.zeros((count, shapes)), np.zeros((count, 6))
    followed = [
        _follow(full, observations, replace(start, weights=still[0], rigid=still[1]))
        for start in _distinct(started, _FOLLOWED)
    ]
    return RegisteredMarkers(full, observations, tuple(_distinct(followed, _FINAL)))


def register_from(
    surface: FaceSurface, observations: Observations, linear: FloatArray, offset: FloatArray
) -> RegisteredMarkers:
    """Register markers to a face from one pose: neutral @ linear + offset is on the face.

    `linear` is (3, 3), `offset` (3,) [m].
    """
    full = candidate_vertices(surface)
    start = replace(_initial(linear, full, observations), offset=offset - full.centre)
    return RegisteredMarkers(full, observations, (_follow(full, observations, start),))


def refine(registered: RegisteredMarkers, observations: Observations) -> Registration:
    """Return the best registration adapted to other observations, from nearby."""
    return _follow(registered.candidates, observations, registered.best)


def _start_poses(candidates: CandidateVertices, observations: Observations) -> list[FloatArray]:
    """Return scaled rotations (3, 3) that turn the flat side of the markers to the front."""
    neutral = observations.neutral[observations.central]
    _, _, axes = np.linalg.svd(neutral - neutral.mean(axis=0), full_matrices=False)
    axes[2] *= np.linalg.det(axes)
    size = expected_scale(candidates, observations)
    found = []
    for flip in (1.0, -1.0):
        upright = axes.T * [1.0, flip, flip]
        for tilt in _TILTS:
            for roll in _ROLLS:
                turned = upright @ _rotation(tilt, roll).T
                found += [scale * size * turned for scale in _SCALES]
    # Names that order the markers by height determine the up direction.
    named = [
        linear
        for linear in found
        if name_disagreement(observations.neutral @ linear, observations) < 1.0
    ]
    return named or found


def _rotation(tilt: float, roll: float) -> FloatArray:
    a, b = np.radians([tilt, roll])
    nod = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
    spin = np.array([[np.cos(b), -np.sin(b), 0], [np.sin(b), np.cos(b), 0], [0, 0, 1]])
    return np.asarray(nod @ spin)


def _anchor_points(candidates: CandidateVertices, observations: Observations) -> FloatArray:
    anchors = observations.anchors[observations.anchored]
    return np.asarray(candidates.points[np.searchsorted(candidates.indices, anchors)])


def _anchored_pose(candidates: CandidateVertices, observations: Observations) -> FloatArray | None:
    """Return the scaled rotation that the anchors determine; None where they lie on a line."""
    target = _anchor_points(candidates, observations)
    source = observations.neutral[observations.anchored]
    for points in (source, target):
        _, lengths, _ = np.linalg.svd(points - points.mean(axis=0))
        if lengths[1] < _LINE * lengths[0]:
            return None
    return similarity_fit(source, target)[0]


def _initial(
    linear: FloatArray, candidates: CandidateVertices, observations: Observations
) -> Registration:
    markers, peaks = len(observations.neutral), len(observations.displacements)
    fixed = observations.anchored
    if fixed.any():
        middle = _anchor_points(candidates, observations).mean(axis=0)
        offset = middle - observations.neutral[fixed].mean(axis=0) @ linear
    else:
        offset = -observations.neutral[observations.moving].mean(axis=0) @ linear
    return Registration(
        linear=linear,
        offset=offset,
        bend=np.zeros((markers, 3)),
        weights=np.zeros((peaks, len(candidates.offsets))),
        rigid=np.zeros((peaks, 6)),
        assigned=np.zeros(markers, dtype=np.int64),
        marker_costs=np.zeros(markers),
        cost=np.inf,
    )


def _start(
    candidates: CandidateVertices, observations: Observations, start: Registration
) -> Registration:
    last = _START_ANNEALED * _FIRST_SHAPE_ERROR
    for step, error in enumerate(np.geomspace(_FIRST_SHAPE_ERROR, last, _START_STEPS)):
        start = align(
            candidates,
            observations,
            start,
            shape_error=error,
            motion_error=np.inf if step < _WITHOUT_MOTION else MOTION_ERROR,
            soft=False,
            clipped=True,
        )
    return start


def _follow(
    candidates: CandidateVertices, observations: Observations, start: Registration
) -> Registration:
    errors = np.geomspace(_FIRST_SHAPE_ERROR, SHAPE_ERROR, _STEPS)
    motions = MOTION_ERROR * np.geomspace(_FIRST_MOTION_ERROR, 1.0, _STEPS)
    for error, motion in zip(errors, motions, strict=True):
        start = align(candidates, observations, start, shape_error=error, motion_error=motion)
    for _ in range(_LAST_STEPS):
        start = align(candidates, observations, start, soft=False)
    return start


def _distinct(registrations: Sequence[Registration], count: int) -> list[Registration]:
    """Return the best registrations that are not nearly the same."""
    best: list[Registration] = []
    for one in sorted(registrations, key=lambda one: one.cost):
        if len(best) < count and all(
            (one.assigned == other.assigned).mean() <= _SAME for other in best
        ):
            best.append(one)
    return best
