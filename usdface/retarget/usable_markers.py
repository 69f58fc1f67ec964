"""The markers of a take that are used in a solve, and degrees of freedom that they leave open."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.errors import InputError, did_you_mean
from usdface.findings import Finding, finding
from usdface.findings.values import Prose
from usdface.geometry.rigid_fit import IN_LINE
from usdface.plain_text import listed
from usdface.retarget.neutral import neutral_markers, on_plane, resting_frames
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake, visible

__all__ = [
    "check_bound_markers",
    "determined",
    "neutral_counts",
    "occlusions",
    "unknown_marker",
    "unsolved_frames",
    "usable_markers",
]


# A marker more than a head pose takes: with three, every motion of them is one of the head.
LEAST_MARKERS = 4
_LISTED = 6  # names in a message


def check_bound_markers(setup: RetargetSetup, take: MarkerTake) -> None:
    """Refuse a binding with too few markers of a take, or vertices, before anything is solved.

    Raises
    ------
    InputError
    """
    bound = setup.binding.markers
    count = len(set(bound) & set(take.names))
    if not bound:
        raise InputError(
            f"the binding binds none of the markers of {take.source}; expected a vertex for each "
            'under "markers", or --propose to find them',
            "MARKERS_TOO_FEW",
        )
    if not count:
        raise InputError(
            f"none of the {len(bound)} bound markers is in the take {take.source}; "
            f"bound: {listed(bound, _LISTED)}; in the take: {listed(take.names, _LISTED)}",
            "MARKER_UNKNOWN",
        )
    if count < LEAST_MARKERS:
        lost = [name for name in bound if name not in take.names]
        also = f"; bound, but not in the take: {listed(lost, _LISTED)}" if lost else ""
        raise InputError(
            f"{count} of the {len(take.names)} markers of {take.source} are bound; at least "
            f"{LEAST_MARKERS} are needed{also}. Bind more, or find vertices for them (--propose)",
            "MARKERS_TOO_FEW",
        )
    pairs = zip(bound, setup.binding.points.tolist(), strict=True)
    vertices = {point for name, point in pairs if name in take.names}
    if len(vertices) < LEAST_MARKERS:
        raise InputError(
            f"the {count} bound markers of {take.source} share {len(vertices)} vertices; at least "
            f"{LEAST_MARKERS} are needed. Bind each marker to its own",
            "MARKERS_TOO_FEW",
        )


def unknown_marker(name: str, unbound: Sequence[str], source: str = "") -> Finding:
    """Report a bound marker that the take does not have.

    Parameters
    ----------
    name : str
    unbound : sequence of str
        Markers of the take that the binding does not name, one of which may be meant.
    source : str
        File of the binding, if it is known.
    """
    hint = Prose(did_you_mean(name, unbound))
    where = f"{source}: {name}" if source else name
    return finding("MARKER_UNKNOWN", where, "the take has no marker {marker!r}{hint}", name, hint)


def usable_markers(
    take: MarkerTake, points: FloatArray, setup: RetargetSetup
) -> tuple[list[int], FloatArray, list[Finding]]:
    """Return the usable bound markers, their neutral, and findings on the others.

    Parameters
    ----------
    take : MarkerTake
    points : (B, 3) float64 [m]
        Vertices of the bound markers on the character.
    setup : RetargetSetup

    Returns
    -------
    used : list of int, length M
        Indices into the bound markers.
    neutral : (M, D) float64
        In the space of the take; the character's vertices for the neutral "rig".
    findings : list of Finding
    """
    check_bound_markers(setup, take)
    binding, findings = setup.binding, []
    known = [i for i, name in enumerate(binding.markers) if name in take.names]
    unbound = [name for name in take.names if name not in binding.markers]
    for name in sorted(set(binding.markers) - set(take.names)):
        findings.append(unknown_marker(name, unbound))
    if unbound:
        findings.append(finding("MARKER_UNBOUND", take.source, "not bound: {markers}", unbound))
    positions = take.select(tuple(binding.markers[i] for i in known))
    if setup.neutral is None:
        if take.dimension == 2:
            raise InputError(
                'a 2D take cannot have the neutral "rig"; name neutral frames', "TAKE_KIND_WRONG"
            )
        neutral = points[known]
    else:
        neutral = neutral_markers(positions, setup.neutral)
        findings += _restless_frames(positions, setup.neutral, take.source)
    ever = np.asarray(visible(positions).any(axis=0))
    resting = visible(neutral)
    for i, name in enumerate(binding.markers[k] for k in known):
        if not ever[i]:
            findings.append(finding("MARKER_NEVER_SEEN", name))
        elif not resting[i]:
            findings.append(finding("MARKER_WITHOUT_NEUTRAL", name))
    keep = np.flatnonzero(ever & resting)
    if len(keep) < LEAST_MARKERS:
        where, other = "", "Bind more"
        if setup.neutral is not None:
            first, last = setup.neutral
            where = f" in the neutral frames {first} to {last}"
            other = "Name other neutral frames (usdface shot --neutral FIRST LAST, or auto)"
            other += ", or bind more" if ever.sum() < LEAST_MARKERS else ""
        raise InputError(
            f"only {len(keep)} of {len(known)} bound markers are visible{where} of {take.source}; "
            f"at least {LEAST_MARKERS} are needed. {other}",
            "MARKERS_TOO_FEW",
        )
    occluded = np.isnan(positions[:, keep, 0]).sum(axis=0)
    used = [known[k] for k in keep]
    findings += occlusions([binding.markers[k] for k in used], occluded, len(positions))
    return used, neutral[keep], findings


def _restless_frames(positions: FloatArray, frames: tuple[int, int], source: str) -> list[Finding]:
    """Report neutral frames in which the face moves."""
    resting = resting_frames(positions, frames)
    if resting.all():
        return []
    message = "the face moves in {moving_count} of {frame_count} neutral frames; they are left out"
    moving = int((~resting).sum())
    return [finding("NEUTRAL_MOVES", source, message, moving, len(resting))]


def neutral_counts(positions: FloatArray, setup: RetargetSetup) -> IntArray | None:
    """Return of how many frames each marker's neutral is the mean: (M,); None for the rig's own."""
    if setup.neutral is None:
        return None
    first, last = setup.neutral
    resting = resting_frames(positions, setup.neutral)
    return np.asarray(visible(positions[first : last + 1][resting]).sum(axis=0))


def determined(
    setup: RetargetSetup, take: MarkerTake, positions: FloatArray, basis: FloatArray
) -> tuple[RetargetSetup, list[Finding]]:
    """Report degrees of freedom that the markers leave open; drop head markers in a line.

    Parameters
    ----------
    setup : RetargetSetup
    take : MarkerTake
    positions : (F, M, D) float64
        Of the usable markers.
    basis : (S, M, 3) float64 [m]
        Offsets of the blend shapes at them.
    """
    findings = []
    if setup.head == "markers":
        rigid = on_plane(take.select(setup.head_markers))
        rest = neutral_markers(rigid, setup.neutral or (0, 0))
        rest = rest[visible(rest)]
        extent = np.linalg.svd(rest - rest.mean(axis=0), compute_uv=False) if len(rest) else [0.0]
        if len(extent) < 2 or extent[1] <= IN_LINE * extent[0]:
            where = ", ".join(setup.head_markers)
            findings.append(finding("HEAD_MARKERS_IN_LINE", where))
            setup = replace(setup, head="solve", head_markers=())
    moved = np.abs(basis).max(axis=(1, 2))
    shapes = int((moved > 1e-9 * moved.max(initial=0.0)).sum())
    known = take.dimension * basis.shape[1] - (6 if setup.head == "solve" else 0)
    if known < shapes:
        message = (
            "{marker_count} markers measure {known_count} coordinates of the face for "
            "{shape_count} blend shapes; undetermined weights stay as small as possible. Bind "
            "more markers"
        )
        findings.append(
            finding("MARKERS_FEW", take.source, message, basis.shape[1], max(known, 0), shapes)
        )
    span = np.nanmax(positions, axis=0) - np.nanmin(positions, axis=0)
    if len(positions) > 1 and not span.any():
        findings.append(finding("TAKE_STILL", take.source))
    return setup, findings


def occlusions(names: Sequence[str], occluded: IntArray, frames: int) -> list[Finding]:
    """Report the markers that are occluded in some of the frames, by how many (M,); most first."""
    message = "occluded in {occluded_count} of {frame_count} frames"
    return [
        finding("MARKER_OCCLUDED", names[m], message, int(occluded[m]), frames)
        for m in np.argsort(-occluded, kind="stable").tolist()
        if occluded[m]
    ]


def unsolved_frames(seen: BoolArray, source: str) -> list[Finding]:
    """Report frames in which no marker (F, M) was used."""
    empty = np.flatnonzero(~seen.any(axis=1))
    if not len(empty):
        return []
    message = (
        "no bound marker, or too few for the head's pose, in {unsolved_count} of {frame_count} "
        "frames, the first of them frame {first_frame}; they follow their neighbours"
    )
    return [finding("FRAME_UNSOLVED", source, message, len(empty), len(seen), empty[0])]
