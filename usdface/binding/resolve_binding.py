"""Where the markers of a shot sit: read from a binding file, proposed, or some of each."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from usdface.binding.propose import check_frames, neutral_frames, propose, strong_frames
from usdface.face.shape_names import rename_weights
from usdface.findings import Finding, finding
from usdface.options import BindOptions
from usdface.retarget.neutral import neutral_markers
from usdface.retarget.neutral_weights import rest_weights
from usdface.retarget_setup import Binding, RetargetSetup, unbound
from usdface.rigs import Mesh, Rig
from usdface.takes import MarkerTake, WeightsTake

__all__ = ["bound_setup", "proposal_summary", "shown_at_rest"]


def bound_setup(
    character: Rig,
    take: MarkerTake | WeightsTake,
    read: RetargetSetup | None,
    notes: Sequence[Finding],
    options: BindOptions,
) -> tuple[Mesh, RetargetSetup, list[Finding]]:
    """Find what the binding file leaves out: places, neutral and peak frames.

    Parameters
    ----------
    character : Rig
    take : MarkerTake or WeightsTake
    read : RetargetSetup or None
        As the binding file has it; without one all places are proposed.
    notes : sequence of Finding
        What was found in the file.
    options : BindOptions

    Returns
    -------
    Mesh
        The bound one.
    RetargetSetup
        Peak frames are in it where they are named, asked for or used to propose places.
    list of Finding
        Those of `notes` that still hold, and more.

    Raises
    ------
    InputError
        If no places can be proposed, or no curve of a take of weights has a shape's name.
    """
    findings = list(notes)
    mesh = character.mesh(read.binding.mesh) if read else character.face()
    if not isinstance(take, MarkerTake):
        rename_weights(take, character.shape_names)  # refused now, and not when it is played
        return mesh, read or unbound(take), findings
    proposing = read is None or options.propose
    named = read is not None and not any(f.code == "NEUTRAL_ASSUMED" for f in findings)
    setup = read or RetargetSetup(Binding((), np.zeros(0, dtype=np.int64)))
    find_neutral = options.neutral == "auto" or (proposing and not (named or options.neutral))
    if find_neutral or options.neutral:
        findings = [f for f in findings if f.code != "NEUTRAL_ASSUMED"]
    if isinstance(options.neutral, tuple):
        setup = replace(setup, neutral=options.neutral, neutral_weights={})
    if options.peaks is not None:
        setup = replace(setup, peaks=() if options.peaks == "auto" else options.peaks)
    check_frames(take, setup.neutral, setup.peaks)
    if proposing:
        setup, more = propose(take, mesh, setup, find_neutral)
        findings += more
    else:
        findings += _unmatched(take, setup)
        if find_neutral:
            setup = replace(setup, neutral=neutral_frames(take))
    if options.peaks == "auto" and not proposing:
        setup = replace(setup, peaks=strong_frames(take, setup.neutral or neutral_frames(take)))
    if find_neutral:
        setup = replace(setup, neutral_weights=shown_at_rest(take, mesh, setup))
        findings.append(_neutral_found(take, setup))
    return mesh, setup, findings


def _unmatched(take: MarkerTake, setup: RetargetSetup) -> list[Finding]:
    """Say which markers of the binding the take lacks, and how many of its own have no place."""
    named = setup.binding.markers
    findings = [
        finding("MARKER_UNKNOWN", name, f"the take has no marker {name!r}")
        for name in named
        if name not in take.names
    ]
    count = len(set(take.names) - {*named, *setup.head_markers})
    if count:  # that may be meant, or an unfinished file
        message = f"{count} of {len(take.names)} markers have no place; --propose finds them some"
        findings.append(finding("MARKER_UNBOUND", take.source, message))
    return findings


def shown_at_rest(take: MarkerTake, mesh: Mesh, setup: RetargetSetup) -> dict[str, float]:
    """Return the blend shapes, and their weights, that the face shows where it rests."""
    vertex = dict(zip(setup.binding.markers, setup.binding.points.tolist(), strict=True))
    names = tuple(n for n in take.names if 0 <= vertex.get(n, -1) < len(mesh.points))
    if not names or setup.neutral is None:
        return {}
    points, positions = np.array([vertex[name] for name in names]), take.select(names)
    neutral = neutral_markers(positions, setup.neutral)
    found = rest_weights(positions, neutral, mesh.points[points], mesh.offsets_at(points))
    pairs = zip(mesh.shape_names, found.round(3).tolist(), strict=True)
    return {name: weight for name, weight in pairs if weight > 0.0}


def _neutral_found(take: MarkerTake, setup: RetargetSetup) -> Finding:
    frames = "{} to {}".format(*setup.neutral or (0, 0))
    message = f"the face rests in frames {frames}: taken as neutral"
    shown = sorted(setup.neutral_weights.items(), key=lambda item: -item[1])
    if shown:
        most = ", ".join(f"{name} {weight:.2f}" for name, weight in shown[:3])
        message += f", without what it shows there ({len(shown)} blend shapes, most {most})"
    return finding("NEUTRAL_FOUND", take.source, message)


def proposal_summary(setup: RetargetSetup) -> dict[str, Any]:
    """Return what the report says of neutral and peak frames, and how sure proposed places are."""
    said: dict[str, Any] = {}
    sure = setup.binding.confidence
    if setup.peaks:
        said["neutral_frames"] = "rig" if setup.neutral is None else list(setup.neutral)
        said["peak_frames"] = list(setup.peaks)
    if sure is not None and not np.isnan(sure).all():
        said["confidence_mean"] = round(float(np.nanmean(sure)), 3)
        said["confidence_min"] = round(float(np.nanmin(sure)), 3)
    return said
