"""Blend shape scores of MediaPipe's Face Landmarker, which have the names of ARKit's curves.

A frame has them as ``face_blendshapes``, ``faceBlendshapes`` or ``blendshapes``: a list of
``{"category_name", "score"}`` (``categoryName``), perhaps in an object as ``categories``, for one
face or in a list of faces, of which the first is read; or an object of names and scores.
A score that is missing in a frame with others is bridged.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from usdface.arrays import FloatArray
from usdface.errors import InputError, errors_at
from usdface.findings import Finding, finding
from usdface.io.takes.json_text import number
from usdface.io.takes.missing_weights import WRITTEN, bridge_weights
from usdface.io.takes.raw_take import check_size
from usdface.io.takes.timing import take_times
from usdface.takes import WeightsTake, check_range

__all__ = ["SHAPES", "read_scores", "score_faces", "scores_take"]

SHAPES = ("face_blendshapes", "faceBlendshapes", "blendshapes")
_NAMES = ("category_name", "categoryName", "display_name", "name")
_NEUTRAL = "_neutral"  # no movement, and 0 in all that has been seen
_MOST = 1000  # blend shapes of a face; MediaPipe's has 52


def read_scores(frame: Any) -> dict[str, float]:
    """Return the scores of the first face in a frame by name, NaN = missing; empty without any."""
    value = _value(frame)
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
    found.pop(_NEUTRAL, None)
    return found if any(map(np.isfinite, found.values())) else {}


def score_faces(frame: Any) -> int:
    """Return of how many faces a frame has scores."""
    value = _value(frame)
    if isinstance(value, dict):
        value = value.get("categories", [value])
    if not isinstance(value, list) or not value:
        return 0
    return len(value) if _name(value[0]) is None else 1


def _value(frame: Any) -> Any:
    own: Mapping[str, Any] = frame if isinstance(frame, dict) else {}
    return next((own[key] for key in SHAPES if key in own), None)


def scores_take(
    path: Path,
    scores: Sequence[Mapping[str, float]],
    seconds: FloatArray,
    numbers: FloatArray,
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
        NaN where frames have no times, which count only if all with scores have them.
    numbers : (F,) float64
        Of the frames in their footage.
    rate : float [Hz]
        Of the file; 0 = none.
    override : float [Hz], optional
        That of the options.

    Raises
    ------
    InputError
        If no frame has scores, or times or numbers do not increase.
    """
    kept = [index for index, own in enumerate(scores) if own]
    names = tuple(dict.fromkeys(name for own in scores for name in own))
    if not kept:
        raise InputError(f"{path}: no frame has blend shapes; expected one at least", "TAKE_EMPTY")
    if len(names) > _MOST:
        raise InputError(f"{path}: {len(names)} blend shapes; expected up to {_MOST}", "TOO_LARGE")
    check_size(path, len(kept), len(names))
    table = [[scores[index].get(name, np.nan) for name in names] for index in kept]
    names, weights, findings = _written(path, names, np.array(table))
    if len(kept) < len(scores):
        message = "{empty_count} of {frame_count} frames hold no weights"
        lost = finding("FRAME_EMPTY", str(path), message, len(scores) - len(kept), len(scores))
        findings.append(lost)
    numbers = numbers[kept]
    if numbers[0] != 0:
        message = "time 0 is frame {frame_number:g} of the footage"
        findings.append(finding("FRAMES_RENUMBERED", str(path), message, numbers[0]))
    timed = bool(np.isfinite(seconds[kept]).all())
    times, rate, time_findings = take_times(
        path,
        len(kept),
        rate=rate,
        seconds=seconds[kept] if timed else None,
        frames=numbers,
        override=override,
    )
    message = "no score in frame {frames}; bridged from the frames around it"
    findings += bridge_weights(path, names, times, weights, kept, message)
    with errors_at(path):
        take = WeightsTake(names, times, weights, rate, source=path.name)
        check_range(take)
    return take, findings + time_findings


def _written(
    path: Path, names: tuple[str, ...], weights: FloatArray
) -> tuple[tuple[str, ...], FloatArray, list[Finding]]:
    """Leave out curves of which most scores are missing: bridges would be their motion."""
    missing = ~np.isfinite(weights)
    enough = 1.0 - missing.mean(axis=0) >= WRITTEN
    if enough.all():
        return names, weights, []
    if not enough.any():
        raise InputError(
            f"{path}: no blend shape has scores in half of the frames; expected at least one",
            "TAKE_EMPTY",
        )
    empty = [name for name, has in zip(names, enough, strict=True) if not has]
    message = "more than half of the frames have no score of {channels}"
    found = finding("CHANNEL_IGNORED", str(path), message, empty)
    left = tuple(name for name in names if name not in set(empty))
    return left, weights[:, enough], [found]


def _name(row: Any) -> str | None:
    """Return the name of a score; None for anything else."""
    if not isinstance(row, dict) or "categories" in row:
        return None
    return next((str(row[key]) for key in _NAMES if row.get(key)), None)
