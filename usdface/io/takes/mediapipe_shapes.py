"""Blend shape scores of MediaPipe's Face Landmarker, which have the names of ARKit's curves.

A frame has them as ``face_blendshapes``, ``faceBlendshapes`` or ``blendshapes``: a list of
``{"category_name", "score"}`` (``categoryName``), perhaps in an object as ``categories``, for one
face or in a list of faces, of which the first is read; or an object of names and scores.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from usdface.arrays import FloatArray
from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.io.takes.json_text import number
from usdface.io.takes.raw_take import check_size
from usdface.io.takes.timing import take_times
from usdface.takes import WeightsTake, check_range

__all__ = ["SHAPES", "read_scores", "scores_take"]

SHAPES = ("face_blendshapes", "faceBlendshapes", "blendshapes")
_NAMES = ("category_name", "categoryName", "display_name", "name")
_NEUTRAL = "_neutral"  # no movement, and 0 in all that has been seen
_MOST = 1000  # blend shapes of a face; MediaPipe's has 52


def read_scores(frame: Any) -> dict[str, float]:
    """Return the scores of the first face in a frame by name; empty if it has none."""
    own: Mapping[str, Any] = frame if isinstance(frame, dict) else {}
    value = next((own[key] for key in SHAPES if key in own), None)
    for _ in range(3):  # an object, of a list of faces, of objects, of scores
        if isinstance(value, dict) and "categories" in value:
            value = value["categories"]
        elif isinstance(value, list) and value and _name(value[0]) is None:
            value = value[0]
    if isinstance(value, dict):
        found = {str(name): number(score) for name, score in value.items()}
    else:
        rows = value if isinstance(value, list) else []
        named = [(_name(row), row) for row in rows]
        found = {name: number(row.get("score")) for name, row in named if name is not None}
    return {name: score for name, score in found.items() if name != _NEUTRAL and np.isfinite(score)}


def scores_take(
    path: Path,
    scores: Sequence[Mapping[str, float]],
    seconds: FloatArray,
    rate: float,
    override: float | None,
) -> tuple[WeightsTake, list[Finding]]:
    """Return the take of weights of the frames that have scores.

    Parameters
    ----------
    path : Path
    scores : sequence of mapping of str to float, length F
        Of each frame, as `read_scores` returns them; empty where it has no face.
    seconds : (F,) float64 [s]
        NaN where frames have no times.
    rate : float [Hz]
        Of the file; 0 = none.
    override : float [Hz], optional
        That of the options.

    Raises
    ------
    InputError
        If no frame has scores, or times do not increase.
    """
    kept = [index for index, own in enumerate(scores) if own]
    names = tuple(dict.fromkeys(name for own in scores for name in own))
    if not kept:
        raise InputError(f"{path}: no frame has blend shapes; expected one at least", "TAKE_EMPTY")
    if len(names) > _MOST:
        raise InputError(f"{path}: {len(names)} blend shapes; expected up to {_MOST}", "TOO_LARGE")
    check_size(path, len(kept), len(names))
    findings = []
    if len(kept) < len(scores):
        message = "{empty_count} of {frame_count} frames hold no weights"
        lost = finding("FRAME_EMPTY", str(path), message, len(scores) - len(kept), len(scores))
        findings.append(lost)
    timed = bool(np.isfinite(seconds[kept]).all())
    times, rate, time_findings = take_times(
        path,
        len(kept),
        rate=rate,
        seconds=seconds[kept] if timed else None,
        frames=np.array(kept, dtype=np.float64),
        override=override,
    )
    weights = np.array([[scores[index].get(name, 0.0) for name in names] for index in kept])
    try:
        take = WeightsTake(names, times, weights, rate, source=path.name)
        check_range(take)
    except InputError as error:
        raise InputError(f"{path}: {error}", error.code) from error
    return take, findings + time_findings


def _name(row: Any) -> str | None:
    """Return the name of a score; None for anything else."""
    if not isinstance(row, dict) or "score" not in row:
        return None
    return next((str(row[key]) for key in _NAMES if row.get(key)), None)
