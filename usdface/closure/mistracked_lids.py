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

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from usdface.arrays import BoolArray, FloatArray
from usdface.cleanup.gaps import frame_ranges
from usdface.closure.lid_gaps import Eye, LidGaps
from usdface.closure.lid_motion import LidMarker, lid_markers
from usdface.face.bound_face import BoundFace
from usdface.face.mirror import midline, mirrored_markers
from usdface.findings import Finding, finding
from usdface.geometry.rigid_fit import Pose
from usdface.retarget.solution import Solution
from usdface.takes import MarkerTake

__all__ = ["without_mistracked_lids"]

_MIRROR = np.array([-1.0, 1.0, 1.0])
# In openings by the rig's shape that opens the eye most: from here on a marker is mistracked.
# AnimFace's Reye_Up in a frown 2.0 to 2.5, all others of its two takes 1.2 at most.
_BEYOND = 1.5
# An eye opens by this share of its closing at least, on a rig without a shape that opens it.
_OPENS = 0.4
# Differences of the two lids, as shares of that limit, between which it is replaced in part.
_LESS, _NOT = 0.25, 0.5


def without_mistracked_lids(
    take: MarkerTake, face: BoundFace, solution: Solution, gaps: Mapping[Eye, LidGaps]
) -> tuple[MarkerTake, list[Finding]] | None:
    """Replace the motion of a mistracked lid marker by that of the other lid.

    Parameters
    ----------
    take : MarkerTake
        In space.
    face : BoundFace
    solution : Solution
        Of the take.
    gaps : mapping of "left", "right" to LidGaps
        Of the solution's blend shapes.

    Returns
    -------
    take : MarkerTake
    findings : list of Finding
        LID_DISBELIEVED for each marker.

    None where no lid marker is mistracked.
    """
    if not solution.in_space or solution.carried is None:
        return None
    if len(gaps) < 2:
        return None
    names = solution.weights.names
    lids = {lid.marker: lid for lid in lid_markers(face, gaps, names, solution)}
    partner = mirrored_markers(solution.rest, midline(solution.rest, face.midline))
    pairs = [(lid, lids[partner[m]]) for m, lid in lids.items() if partner[m] in lids]
    positions, findings = take.positions.copy(), []
    for lid, other in pairs:
        shares, moved = _replacement(lid, other, face, gaps, solution)
        frames = np.flatnonzero(shares)
        if not len(frames):
            continue
        name = solution.markers[lid.marker]
        own = take.names.index(name)
        shift = (shares[:, None] * moved) @ np.linalg.pinv(solution.carried[lid.marker])
        pose = Pose(solution.pose.rotations[frames], solution.pose.translations[frames])
        head = pose.to_head(take.positions[frames, own][:, None])
        positions[frames, own] = pose.to_take(head + shift[frames, None])[:, 0]
        away = 1000 * float(np.linalg.norm(moved[frames], axis=1).max())
        findings.append(_replaced(name, solution.markers[other.marker], shares > 0, away))
    return (replace(take, positions=positions), findings) if findings else None


def _replacement(
    lid: LidMarker,
    other: LidMarker,
    face: BoundFace,
    gaps: Mapping[Eye, LidGaps],
    solution: Solution,
) -> tuple[FloatArray, FloatArray]:
    """Return the share of a lid marker's motion to replace, 0 to 1: (F,), and its shift: (F, 3).

    The shift [m] is from its own place to that by the other lid, on the character.
    """
    displacements = solution.displacements
    own = displacements[:, lid.marker] - lid.skin(displacements)
    twin = (displacements[:, other.marker] - other.skin(displacements)) * _MIRROR
    limit = _BEYOND * _widest(lid, face, gaps, solution)
    closed = lid.closed(own)
    apart = (lid.closed(twin) - closed) / limit
    measured = np.isfinite(solution.distances[:, [lid.marker, other.marker]]).all(axis=1)
    certain = measured & (closed < -limit) & (apart > 1.0)
    stretch = _around(measured & (apart > _LESS), certain)
    shares = np.where(stretch, np.clip((apart - _LESS) / (_NOT - _LESS), 0.0, 1.0), 0.0)
    return shares, twin - own


def _widest(
    lid: LidMarker, face: BoundFace, gaps: Mapping[Eye, LidGaps], solution: Solution
) -> float:
    """Return how far the rig opens the eye at most, in closings of it: above 0."""
    marker = face.markers.index(solution.markers[lid.marker])
    opened = -lid.closed(face.offsets[:, marker])
    names = solution.weights.names
    raisers = [face.shape_names.index(names[shape]) for shape in gaps[lid.eye].raisers]
    return float(max(opened[raisers].max(initial=0.0), _OPENS))


def _around(where: BoolArray, certain: BoolArray) -> BoolArray:
    """Return the stretches of `where` that have a certain frame."""
    found = np.zeros(len(where), dtype=bool)
    for first, last in frame_ranges(where):
        found[first : last + 1] = certain[first : last + 1].any()
    return found


def _replaced(marker: str, other: str, where: BoolArray, away_mm: float) -> Finding:
    stretches = list(frame_ranges(where))
    message = (
        "opens the eye further than a lid can while {other} does not: not believed in "
        "{frame_count} frames ({first_frame} to {last_frame}), up to {distance_mm:.1f} mm off; it "
        "moves as {other}"
    )
    return finding(
        "LID_DISBELIEVED",
        marker,
        message,
        other,
        int(where.sum()),
        stretches[0][0],
        stretches[-1][1],
        away_mm,
    )
