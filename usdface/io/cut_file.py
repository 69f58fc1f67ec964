"""Cuts: the clips of an editorial timeline, read by OpenTimelineIO (an optional extra)."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from usdface.errors import InputError, PluginError
from usdface.findings import Finding, finding

__all__ = ["CutEvent", "read_cut", "timecode_seconds"]

_SUFFIXES = (".otio", ".edl")
_LARGEST = 64_000_000  # bytes


@dataclass(frozen=True, slots=True)
class CutEvent:
    """A clip of a cut.

    Attributes
    ----------
    name : str
        Of the clip; "" = not named.
    media : tuple of str
        Names of its media: reel, reference and file.
    start : float [s]
        Timecode of its first frame, as frames over the whole frames a second that it counts.
    frames : int
        Its length.
    rate : float [Hz]
    """

    name: str
    media: tuple[str, ...]
    start: float
    frames: int
    rate: float


def read_cut(path: Path) -> tuple[list[CutEvent], list[Finding]]:
    """Read the clips of all video tracks of a cut, in their order.

    Parameters
    ----------
    path : Path
        .otio, or .edl (CMX 3600).

    Raises
    ------
    InputError
        If it cannot be read, or has no clips.
    PluginError
        If OpenTimelineIO is not installed.
    """
    if path.suffix.lower() not in _SUFFIXES:
        raise InputError(f"{path} is no cut; expected {', '.join(_SUFFIXES)}", "FILE_KIND_UNKNOWN")
    otio = _library(path)
    try:
        if path.stat().st_size > _LARGEST:
            raise InputError(f"{path} is larger than any cut", "TOO_LARGE")
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"cannot read the cut {path}: {error}", "FILE_UNREADABLE") from error
    kind = "otio_json" if path.suffix.lower() == ".otio" else "cmx_3600"
    try:
        if kind == "otio_json":
            json.loads(text)  # the library's own parser takes less for JSON
        timeline = otio.adapters.read_from_string(text, kind)
        clips = list(timeline.find_clips())
    except Exception as error:  # adapters raise anything
        raise InputError(f"cannot read the cut {path}: {error}", "FILE_UNREADABLE") from error
    events, findings = [], []
    for clip in clips:
        if clip.parent() is not None and getattr(clip.parent(), "kind", "Video") != "Video":
            continue
        if clip.effects:
            message = "speed changes and effects of the cut are left out: the range is of the take"
            findings.append(finding("CUT_EFFECT_IGNORED", clip.name or str(path), message))
        event = _event(clip)
        if event is not None:
            events.append(event)
    if not events:
        raise InputError(f"the cut {path} has no clips with a range", "SHOT_INCOMPLETE")
    return events, findings


def timecode_seconds(text: str, rate: float, where: str) -> float:
    """Return a SMPTE timecode as frames over the whole frames a second that it counts [s].

    Parameters
    ----------
    text : str
        ``HH:MM:SS:FF``, with ``;`` before the frames for drop frame, perhaps with a fraction of a
        frame.
    rate : float [Hz]
        That it counts.
    where : str
        For the error.

    Raises
    ------
    InputError
        If it is none.
    """
    dropped = ";" in text
    words = text.replace(";", ":").split(":")
    try:
        hours, minutes, seconds = (int(word) for word in words[:3])
        frame = float(words[3])
        whole = len(words) == 4 and 0 <= minutes < 60 and 0 <= seconds < 60
        if not whole or hours < 0 or not 0 <= frame < max(round(rate), 1):
            raise ValueError(text)
    except (ValueError, IndexError) as error:
        raise InputError(
            f"{where}: the timecode {text!r} at {rate:g} frames a second; expected HH:MM:SS:FF",
            "VALUES_WRONG",
        ) from error
    nominal = round(rate)
    total = 60 * hours + minutes
    skipped = round(nominal / 15) * (total - total // 10) if dropped else 0
    return (60 * total + seconds) + (frame - skipped) / nominal


def _library(path: Path) -> Any:
    try:
        import opentimelineio
    except ImportError as error:
        raise PluginError(
            f"{path}: cuts are read by OpenTimelineIO, which is not installed "
            "(pip install usdface[otio])"
        ) from error
    return opentimelineio


def _event(clip: Any) -> CutEvent | None:
    """Return a clip that has a range; one of an empty reel has none."""
    reference = clip.media_reference
    given = clip.source_range or (reference.available_range if reference else None)
    if given is None or not given.duration.value > 0 or not given.start_time.rate > 0:
        return None
    rate = float(given.start_time.rate)
    names = [
        str(dict(clip.metadata.get("cmx_3600", {})).get("reel", "")),
        reference.name if reference else "",
        Path(str(getattr(reference, "target_url", "") or "")).stem,
    ]
    return CutEvent(
        clip.name or "",
        tuple(name for name in names if name),
        float(given.start_time.value) / round(rate),
        round(given.duration.rescaled_to(rate).value),
        rate,
    )
