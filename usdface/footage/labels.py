"""Names of tracks: from places that the user named, else numbers."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from usdface.arrays import FloatArray
from usdface.errors import InputError
from usdface.footage.face_names import BoundVertices, pair_with_face
from usdface.footage.follow import HIDDEN, nearest_distances
from usdface.footage.still_places import median_visible

__all__ = ["DotName", "name_tracks"]

# A name belongs to a dot within this share of the distance to its nearest neighbour.
_REACH = 0.5


@dataclass(frozen=True, slots=True)
class DotName:
    """The name of the dot at a place of a frame: x right, y down [px]."""

    name: str
    x: float
    y: float
    frame: int = 0


def name_tracks(
    places: FloatArray,
    named: Sequence[DotName],
    face: BoundVertices | None = None,
    reference: int = 0,
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the name of each track of places (F, M, 2), and the names that no dot is near to.

    Dots that the user did not name are named by the vertices of a face, where it is given, in its
    neutral frames or else in the reference frame.

    Raises
    ------
    InputError
        If a name occurs twice, or a frame is not in the film.
    """
    count = places.shape[1]
    names = [""] * count
    given = [each.name for each in named]
    if len(set(given)) < len(given):
        twice = next(name for name in given if given.count(name) > 1)
        raise InputError(f"the name {twice!r} of a dot occurs twice", "NAME_REPEATED")
    left = []
    for frame in sorted({each.frame for each in named}):
        if not 0 <= frame < len(places):
            raise InputError(
                f"a dot is named in frame {frame}; the film has the frames 0 to {len(places) - 1}",
                "FRAMES_OUTSIDE",
            )
        wanted = [each for each in named if each.frame == frame]
        seen = np.flatnonzero(~np.isnan(places[frame, :, 0]) & np.array([not n for n in names]))
        if not len(seen):
            left += [each.name for each in wanted]
            continue
        there = np.array([(each.x, each.y) for each in wanted])
        away = np.linalg.norm(there[:, None] - places[frame, seen], axis=2)
        limit = _REACH * nearest_distances(places[frame, seen]).clip(max=1e6)
        share = away / limit
        # Beyond reach all are equally far: a name without a dot must not push others along.
        rows, columns = linear_sum_assignment(np.minimum(share, 1.0))
        for row, column in zip(rows.tolist(), columns.tolist(), strict=True):
            if share[row, column] < 1.0:
                names[seen[column]] = wanted[row].name
        left += [each.name for each in wanted if each.name not in names]
    if face is not None:
        left += _name_by_face(names, given, places, face, reference)
    taken = set(names) | set(given)
    numbers = iter(f"dot_{k + 1:02d}" for k in range(10_000))
    unused = (name for name in numbers if name not in taken)
    return tuple(name or next(unused) for name in names), tuple(left)


def _name_by_face(
    names: list[str],
    given: list[str],
    places: FloatArray,
    face: BoundVertices,
    reference: int,
) -> list[str]:
    """Name the dots that have no name yet; return the names that no dot has."""
    first, last = face.neutral or (reference, reference)
    if last >= len(places):
        raise InputError(
            f"the binding's neutral frames end at {last}; the film has the frames 0 to "
            f"{len(places) - 1}",
            "FRAMES_OUTSIDE",
        )
    rest = median_visible(places[first : last + 1])
    dots = np.flatnonzero(~np.isnan(rest[:, 0]))
    pairs = pair_with_face(rest[dots], face.points)
    left = []
    for name, dot in zip(face.names, pairs.tolist(), strict=True):
        if name in given:
            continue  # the user says where it is
        if dot == HIDDEN or names[dots[dot]]:
            left.append(name)
        else:
            names[dots[dot]] = name
    return left
