"""Faces judged by action units: `usdface check --facs`."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from usdface.correction.events import events_of
from usdface.errors import UsdFaceError
from usdface.face.expression_poses import expressions_for
from usdface.facs.peaks import TakePeaks, judge_peaks
from usdface.facs.report import FacsReport, facs_findings, judge_rig
from usdface.findings import Finding, finding
from usdface.io.gltf.external_files import may_be_gltf
from usdface.io.rigs.files import read_rig_file
from usdface.numerics.local_maxima import highest
from usdface.options import RESPONSE
from usdface.shot.played_shot import PlayedShot
from usdface.takes import frame_step

__all__ = ["judge_file"]


def judge_file(path: Path, figure: Path | None) -> tuple[dict[str, Any], list[Finding]]:
    """Judge the face of a file: a rig, a shot, or the result of `process`.

    Parameters
    ----------
    path : Path
        USD or glTF.
    figure : Path, optional
        Draw the verdicts.

    Returns
    -------
    dict
        The verdicts as plain values; empty if the face cannot be judged.
    list of Finding
    """
    try:
        report = _judged(path)
    except UsdFaceError as error:
        return {}, [finding("FACS_NOT_JUDGED", str(path), "{error}", error)]
    findings = list(facs_findings(report))
    if not any(shape.claim for shape in report.shapes.verdicts):
        message = "no name of its {shape_count} blend shapes is that of an action unit"
        findings.append(finding("FACS_NOT_JUDGED", str(path), message, len(report.shapes.verdicts)))
    if figure:
        from usdface.figures.facs import write_facs_figure

        write_facs_figure(report, figure)
    return report.as_dict(), findings


def _judged(path: Path) -> FacsReport:
    played = None if may_be_gltf(path) else _played(path)
    if played is None:
        rig, _ = read_rig_file(path)
        return judge_rig(rig, expressions_for(rig.shape_names)[0])
    shot = played.shot
    report = judge_rig(shot.rig, shot.expressions)
    peaks = _peaks(played)
    return replace(report, peaks=judge_peaks(report, peaks)) if peaks else report


def _played(path: Path) -> PlayedShot | None:
    """Return the shot of a stage; None where it has none."""
    from usdface.io.usd.played_shot import has_setup, read_played_shot
    from usdface.io.usd.stage import open_stage

    stage = open_stage(path)
    return read_played_shot(stage, str(path))[0] if has_setup(stage) else None


def _peaks(played: PlayedShot) -> TakePeaks | None:
    """Return the peak of each event of an emotion; None of a shot that was not processed."""
    shot = played.shot
    onset = shot.system.response[0] if shot.system is not None else RESPONSE[0]
    found: list[tuple[int, str]] = []
    step = frame_step(shot.take.times)
    for emotion, curve in played.emotions.items():
        frames = events_of(curve, onset, step).frames
        events = np.split(frames, np.flatnonzero(np.diff(frames) > 1) + 1)
        # An output has a flat top where the classifier alone raises it.
        found += [(int(event[highest(curve[event])]), emotion) for event in events if len(event)]
    if not found or not len(played.feature_points):
        return None
    found.sort()
    frames = np.array([frame for frame, _ in found])
    face = shot.face
    vertices = face.vertices_of(played.markers)
    solved = played.solved
    columns = [solved.names.index(name) for name in played.corrected.names]
    return TakePeaks(
        emotions=tuple(emotion for _, emotion in found),
        frames=frames,
        times=shot.take.times[frames] - shot.take.times[0],
        neutral=face.mesh.points[vertices],
        markers=played.feature_points[frames],
        residual=played.residual[frames],
        names=played.corrected.names,
        solved=solved.weights[frames][:, columns],
        corrected=played.corrected.weights[frames],
    )
