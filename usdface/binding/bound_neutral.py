"""The neutral frames of a take whose markers are bound: rig and performer's file judge them."""

from collections.abc import Sequence

import numpy as np

from usdface.arrays import FloatArray, IntArray
from usdface.binding.candidates import LARGEST_WEIGHT
from usdface.binding.explaining_neutral import explaining_neutral
from usdface.binding.held_poses import held_poses
from usdface.binding.neutral_frames import distant_frames, shows_poses
from usdface.binding.observations import Observations, observe
from usdface.binding.peak_motion import Targets
from usdface.binding.registration import MOTION_ERROR, Registration
from usdface.binding.stabilised_film import stabilised_film
from usdface.binding.stabilised_take import (
    FEWEST_MARKERS,
    StabilisedTake,
    stabilised_take,
    without_head,
)
from usdface.errors import InputError
from usdface.face.bound_face import BoundFace
from usdface.geometry.marker_spread import rms_radius
from usdface.geometry.rigid_fit import similarity_fit
from usdface.retarget.film.film_head import FEWEST_FILMED
from usdface.setup.performer_face import PerformerFace
from usdface.takes import MarkerTake

__all__ = ["bound_neutral"]


def bound_neutral(
    take: MarkerTake, face: BoundFace, performer: PerformerFace | None = None
) -> tuple[int, int]:
    """Return the first and last frame index of the held pose that is the likeliest neutral.

    Of the poses that the face holds, the one from which the rig explains the peak frames, by the
    rule of proposed places; by the markers alone, as `neutral_frames`, where fewer than four bound
    ones of a take in space are seen.

    Parameters
    ----------
    take : MarkerTake
        In space or of an image.
    face : BoundFace
        With markers of the take that are bound to vertices of the mesh.
    performer : PerformerFace, optional
        A pose of a take in space that is near to its resting markers is likelier.

    Raises
    ------
    InputError
        If the take has too few markers for the head pose.
    """
    film = take.dimension == 2
    if film and not shows_poses(take, face.markers):
        raise InputError(
            f"no frame of the take {take.source} shows {FEWEST_FILMED} bound markers; neutral "
            "frames cannot be found in its image. Name them, as in --neutral 0 30",
            "MARKERS_TOO_FEW",
        )
    seen = np.flatnonzero(take.visible.any(axis=0))
    bound = np.array([take.names[i] in face.vertex_of for i in seen], dtype=bool)
    markers = [take.names[i] for i in seen[bound]]
    if film:  # the others are at an unknown depth
        stabilised = _film_without_head(take.with_markers(seen[bound]), face)
        bound = bound[bound]
    else:
        stabilised = without_head(take, "neutral")
    held = held_poses(stabilised, take.times)
    peaks = distant_frames(stabilised, held[0].frames)
    if len(markers) < FEWEST_MARKERS or not len(peaks) or not face.shape_names:
        return held[0].frames
    positions = stabilised.positions[:, bound]
    observed = [_observed(positions, pose.frames, peaks) for pose in held]
    vertices = face.vertices_of(markers)
    points = face.mesh.points[vertices]
    points = points - points.mean(axis=0)
    offsets = LARGEST_WEIGHT * face.mesh.offsets_at(vertices)
    return explaining_neutral(
        held,
        observed,
        Targets(points, offsets[..., :2] if film else offsets, np.ones(len(points))),
        start=_registered(observed[0], points, len(face.shape_names)),
        size=rms_radius(points),
        away=_from_rest(observed, markers, performer) if performer and not film else 0.0,
    )


def _film_without_head(take: MarkerTake, face: BoundFace) -> StabilisedTake:
    """Return the markers of a take of an image, all of them bound, without head motion."""
    vertices = face.vertices_of(take.names)
    return stabilised_take(
        stabilised_film(take, face.mesh.points[vertices], face.mesh.offsets_at(vertices))
    )


def _observed(positions: FloatArray, neutral: tuple[int, int], peaks: IntArray) -> Observations:
    """Return the peak frames from a pose; no marker's place is in doubt."""
    count = positions.shape[1]
    return observe(
        positions, neutral, peaks, anchors=np.full(count, -1), heights=np.full(count, np.nan)
    )


def _registered(observed: Observations, points: FloatArray, shapes: int) -> Registration:
    """Return the registration of markers at given points (M, 3) [m]: a similarity."""
    count, peaks = len(points), len(observed.displacements)
    linear, offset = similarity_fit(observed.neutral, points)
    return Registration(
        linear=linear,
        offset=offset,
        bend=np.zeros((count, 3)),
        weights=np.zeros((peaks, shapes)),
        rigid=np.zeros((peaks, 6)),
        assigned=np.arange(count),
        marker_costs=np.zeros(count),
        cost=0.0,
    )


def _from_rest(
    observed: Sequence[Observations], markers: Sequence[str], performer: PerformerFace
) -> FloatArray | float:
    """Return how far the poses are from the performer's rest: mean squares, in expected errors.

    Under a similarity: another session may have another unit or origin. 0 where too few markers
    are the performer's.
    """
    rows = [i for i, name in enumerate(markers) if name in performer.markers]
    if len(rows) < FEWEST_MARKERS:
        return 0.0
    rest = performer.rest[[performer.markers.index(markers[i]) for i in rows]]
    unit = MOTION_ERROR * rms_radius(rest)

    def away(pose: FloatArray) -> float:
        linear, offset = similarity_fit(pose, rest)
        return float(((pose @ linear + offset - rest) ** 2).sum(axis=1).mean()) / unit**2

    return np.array([away(each.neutral[rows]) for each in observed])
