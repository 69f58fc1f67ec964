"""Mistracked lid markers: detected by the other lid, and replaced by its motion.

A lid marker that is lost behind a lowered brow is often tracked on as something else. It is
mistracked where, relative to the skin around it, it opens the eye further than the rig's widest
eye, and the marker of the other lid does not. Both upper lids open alike, since they are raised by
one command (A. Gay, M. Salmon, C. Windsor, "Hering's law, the levators, and their relationship in
disease states", Archives of Ophthalmology 77, 1967); an eye that closes alone, a wink, is no
contradiction.

There its motion over the skin around it is replaced by the other lid's, in proportion to their
difference.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.closure.lid_apertures import Eye, LidApertures
from usdface.closure.lid_motion import LidMarker, lid_markers
from usdface.face.bound_face import BoundFace
from usdface.face.mirror import midline, mirrored_markers
from usdface.findings import Finding, finding
from usdface.numerics.frame_ranges import frame_ranges
from usdface.numerics.ramps import linear_ramp
from usdface.retarget.solution import Solution
from usdface.takes import MarkerTake, frame_step

__all__ = [
    "MistrackedLid",
    "joined_lids",
    "lid_pairs",
    "lid_reach",
    "mistracked_findings",
    "mistracked_lids",
    "with_replaced_lids",
]

_MIRROR = np.array([-1.0, 1.0, 1.0])
# In openings by the rig's shape that opens the eye most: from here on a marker is mistracked.
# AnimFace's Reye_Up in a frown 2.0 to 2.5, all others of its two takes 1.2 at most.
_BEYOND = 1.5
# An eye opens by this share of its closing at least, on a rig without a shape that opens it.
_OPENS = 0.4
# Openings of the eye: a marker that the closing shape moves by less is beside the lid, and does not
# show how far it is open. AnimFace's move by 0.48 on ICT, by 0.12 on the example, where a raised
# brow was taken for a wide eye.
_LEAST_CLOSING = 0.25
# Differences of the two lids, as shares of that limit, between which it is replaced in part.
_REPLACED = (0.25, 0.5)
# s: so far from a certain frame a stretch is replaced. That of AnimFace's frown takes 3.5 s in all.
_REACH = 5.0


@dataclass(frozen=True, eq=False, slots=True)
class MistrackedLid:
    """A lid marker that is mistracked, and where it is instead.

    Attributes
    ----------
    marker : str
    other : str
        The marker of the other lid, whose motion it gets.
    frames : (N,) int64
        Where it is mistracked, in ascending order.
    positions : (N, 3) float64
        Of it there, in take space.
    away : (N,) float64 [m]
        From where it was tracked, on the character.
    """

    marker: str
    other: str
    frames: IntArray
    positions: FloatArray
    away: FloatArray

    def within(self, frames: slice, first: int) -> "MistrackedLid":
        """Return it in some frames alone, the first of which becomes frame `first`."""
        own = (self.frames >= frames.start) & (self.frames < frames.stop)
        kept = self.frames[own] - frames.start + first
        return replace(self, frames=kept, positions=self.positions[own], away=self.away[own])


def lid_reach(times: FloatArray) -> int:
    """Return from how many frames away another frame can show that a marker is mistracked.

    Of a take at `times` (F,) [s].
    """
    step = frame_step(times)
    return round(_REACH / step) if step > 0.0 else 1


def lid_pairs(
    face: BoundFace, solution: Solution, by_eye: Mapping[Eye, LidApertures]
) -> list[tuple[LidMarker, LidMarker]]:
    """Return each lid marker that has one on the other lid, with that; none in an image."""
    if solution.dimension != 3 or len(by_eye) < 2:
        return []
    names = solution.weights.names
    lids = {
        lid.marker: lid
        for lid in lid_markers(face, by_eye, names, solution, of_rig=True)
        if np.linalg.norm(lid.closing) >= _LEAST_CLOSING * by_eye[lid.eye].opening
    }
    partner = mirrored_markers(solution.rest, midline(solution.rest, face.midline))
    return [(lid, lids[partner[m]]) for m, lid in lids.items() if partner[m] in lids]


def mistracked_lids(
    take: MarkerTake,
    face: BoundFace,
    solution: Solution,
    by_eye: Mapping[Eye, LidApertures],
    reach: int,
) -> tuple[MistrackedLid, ...]:
    """Find mistracked lid markers, and where they are by the motion of the other lid.

    Parameters
    ----------
    take : MarkerTake
        In space.
    face : BoundFace
    solution : Solution
        Of the take.
    by_eye : mapping of "left", "right" to LidApertures
        Of the solution's blend shapes.
    reach : int
        `lid_reach` of the take. A frame is judged by those that lie so near, so that a piece of a
        take is judged as the whole is.
    """
    found: list[MistrackedLid] = []
    for lid, other in lid_pairs(face, solution, by_eye):
        shares, moved = _replacement(lid, other, face, by_eye, solution, reach)
        frames = np.flatnonzero(shares)
        if not len(frames):
            continue
        name = solution.markers[lid.marker]
        shift = (shares[:, None] * moved) @ np.linalg.pinv(solution.marker_maps[lid.marker])
        pose = solution.pose.at(frames)
        head = pose.to_head(take.positions[frames, take.names.index(name)][:, None])
        positions = pose.to_take(head + shift[frames, None])[:, 0]
        away = np.linalg.norm(moved[frames], axis=1)
        found.append(MistrackedLid(name, solution.markers[other.marker], frames, positions, away))
    return tuple(found)


def with_replaced_lids(take: MarkerTake, lids: Iterable[MistrackedLid]) -> MarkerTake:
    """Return the take with mistracked lid markers where they are instead."""
    positions = take.positions.copy()
    for lid in lids:
        positions[lid.frames, take.names.index(lid.marker)] = lid.positions
    return replace(take, positions=positions)


def joined_lids(lids: Iterable[MistrackedLid]) -> tuple[MistrackedLid, ...]:
    """Return mistracked lids of pieces in their order as those of the whole, by name."""
    parts: dict[str, list[MistrackedLid]] = {}
    for lid in lids:
        if len(lid.frames):
            parts.setdefault(lid.marker, []).append(lid)
    return tuple(
        MistrackedLid(
            marker,
            own[0].other,
            np.concatenate([lid.frames for lid in own]),
            np.concatenate([lid.positions for lid in own]),
            np.concatenate([lid.away for lid in own]),
        )
        for marker, own in sorted(parts.items())
    )


def mistracked_findings(lids: Iterable[MistrackedLid]) -> list[Finding]:
    """Return LID_DISBELIEVED for each mistracked lid marker, by name."""
    message = (
        "opens the eye further than a lid can while {other} does not: rejected in "
        "{frame_count} frames ({first_frame} to {last_frame}), up to {distance_mm:.1f} mm off; it "
        "moves as {other}"
    )
    return [
        finding(
            "LID_DISBELIEVED",
            lid.marker,
            message,
            lid.other,
            len(lid.frames),
            int(lid.frames[0]),
            int(lid.frames[-1]),
            1000 * float(lid.away.max()),
        )
        for lid in sorted(lids, key=lambda lid: lid.marker)
    ]


def _replacement(
    lid: LidMarker,
    other: LidMarker,
    face: BoundFace,
    by_eye: Mapping[Eye, LidApertures],
    solution: Solution,
    reach: int,
) -> tuple[FloatArray, FloatArray]:
    """Return the share of a lid marker's motion to replace, 0 to 1: (F,), and its shift: (F, 3).

    The shift [m] is from its own place to that by the other lid, on the character.
    """
    displacements = solution.displacements
    own = displacements[:, lid.marker] - lid.skin(displacements)
    twin = (displacements[:, other.marker] - other.skin(displacements)) * _MIRROR
    limit = _BEYOND * _widest(lid, face, by_eye, solution)
    closed = lid.closed(own)
    apart = (lid.closed(twin) - closed) / limit
    measured = np.isfinite(solution.distances[:, [lid.marker, other.marker]]).all(axis=1)
    certain = measured & (closed < -limit) & (apart > 1.0)
    certainty = _certainty(measured & (apart > _REPLACED[0]), certain, reach)
    shares = certainty * linear_ramp(apart, *_REPLACED)
    return np.where(certainty > 0.0, shares, 0.0), twin - own


def _widest(
    lid: LidMarker, face: BoundFace, by_eye: Mapping[Eye, LidApertures], solution: Solution
) -> float:
    """Return how far the rig opens the eye at most, in closings of it: above 0."""
    marker = face.markers.index(solution.markers[lid.marker])
    opened = -lid.closed(face.offsets[:, marker])
    names = solution.weights.names
    raisers = [face.shape_names.index(names[shape]) for shape in by_eye[lid.eye].raisers]
    return float(max(opened[raisers].max(initial=0.0), _OPENS))


def _certainty(where: BoolArray, certain: BoolArray, reach: int) -> FloatArray:
    """Return how certain it is that each frame is mistracked: (F,), 0 to 1.

    1 near a certain frame in the same stretch of `where`, falling to 0 over the last fifth of the
    reach.
    """
    shares = np.zeros(len(where))
    for first, last in frame_ranges(where):
        sure = first + np.flatnonzero(certain[first : last + 1])
        if len(sure):
            frames = np.arange(first, last + 1)
            after = np.searchsorted(sure, frames).clip(0, len(sure) - 1)
            before = np.maximum(after - 1, 0)
            away = np.minimum(np.abs(sure[after] - frames), np.abs(sure[before] - frames))
            shares[frames] = np.clip(5.0 * (1.0 - away / max(reach, 1)), 0.0, 1.0)
    return shares
