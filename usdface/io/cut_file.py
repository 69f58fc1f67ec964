"""Cuts: the clips of an editorial timeline, read by OpenTimelineIO (an optional extra)."""

import json
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from usdface.errors import InputError, PluginError, how_to_install
from usdface.findings import Finding, finding
from usdface.io.drop_frame import dropped_labels

__all__ = ["CutEvent", "read_cut", "timecode_seconds"]

_SUFFIXES = (".otio", ".edl")
_LARGEST = 64_000_000  # bytes
# Frames a second that an .edl is taken to count, which it does not say: those of film, and with
# drop-frame timecode (";") those of NTSC video (SMPTE ST 12-1).
_FILM, _NTSC = 24.0, 30_000 / 1001
_DROPPED = re.compile(r"\d\d:\d\d:\d\d;\d\d")


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


def read_cut(path: Path, rate: float = 0.0) -> tuple[list[CutEvent], list[Finding]]:
    """Read the clips of all video tracks of a cut, in their order.

    Parameters
    ----------
    path : Path
        .otio, or .edl (CMX 3600).
    rate : float [Hz]
        That an .edl counts; 0: 24, or 29.97 with drop-frame timecode, which is reported
        (RATE_ASSUMED).

    Raises
    ------
    InputError
        If it cannot be read, or has no clips; if a rate is given for an .otio, which has its own.
    PluginError
        If OpenTimelineIO is not installed.
    """
    if path.suffix.lower() not in _SUFFIXES:
        raise InputError(f"{path} is no cut; expected {', '.join(_SUFFIXES)}", "FILE_KIND_UNKNOWN")
    otio = _library(path)
    try:
        if path.stat().st_size > _LARGEST:
            raise InputError(f"{path} is larger than any cut", "TOO_LARGE")
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"cannot read the cut {path}: {reason}", "FILE_UNREADABLE") from error
    clips, findings = _clips(otio, path, text, rate)
    events = []
    for clip, ignored in clips:
        where = clip.name or str(path)
        event = _event(clip)
        if event is None:
            message = "the cut names no range of it; it has no shot"
            findings.append(finding("CUT_TAKE_MISSING", where, message))
            continue
        findings += [finding("CUT_EFFECT_IGNORED", where, message) for message in ignored]
        events.append(event)
    if not events:
        raise InputError(
            f"the cut {path} has no clips with a range; expected a timeline of clips",
            "SHOT_INCOMPLETE",
        )
    return events, findings


def _clips(
    otio: Any, path: Path, text: str, rate: float
) -> tuple[list[tuple[Any, list[str]]], list[Finding]]:
    """Return the clips of a cut, each with its effects that are ignored."""
    edl = path.suffix.lower() == ".edl"
    if rate and not edl:
        raise InputError(f"{path} has its own rate; leave out that of the cut", "SETTING_WRONG")
    counted = rate or (_NTSC if _DROPPED.search(text) else _FILM)
    try:
        if edl:
            counted = otio.opentime.RationalTime.nearest_smpte_timecode_rate(counted)
            timeline = otio.adapters.read_from_string(text, "cmx_3600", rate=counted)
        else:
            json.loads(text)  # the library's own parser takes less for JSON
            timeline = otio.adapters.read_from_string(text, "otio_json")
        # Their tracks are the timeline's, and gone with it.
        found = filter(_is_video, timeline.find_clips())
        clips = [(clip, list(_ignored(clip, nested=not edl))) for clip in found]
    except Exception as error:  # adapters raise anything
        where = f" at {counted:g} frames a second (--cut-rate)" if edl else ""
        raise InputError(
            f"cannot read the cut {path}{where}: {error}", "FILE_UNREADABLE"
        ) from error
    if rate or not edl:
        return clips, []
    return clips, [finding("RATE_ASSUMED", str(path), "taken as {rate_hz:g} Hz", counted)]


def _ignored(clip: Any, nested: bool) -> Iterator[str]:
    """Yield the effects of a cut on a clip, beside the choice of its range.

    A list of edits is not `nested`: the library trims its track by the record timecodes.
    """
    above = list(_above(clip))
    if any(part.effects for part in (clip, *above)):
        yield "speed changes and effects of the cut are left out: the range is of the take"
    if nested and any(part.source_range is not None for part in above):
        yield "an enclosing item trims it; its whole range is taken"
    if not all(part.enabled for part in (clip, *above)):
        yield "it is switched off in the cut; it has a shot nevertheless"
    beside = getattr(clip.parent(), "neighbors_of", lambda _: ())(clip)  # of a track
    if any(part is not None and part.schema_name() == "Transition" for part in beside):
        yield "a transition shows frames beyond its range, which --handles add"


def _above(part: Any) -> Iterator[Any]:
    """Yield the tracks and stacks that hold a part of a timeline, from the nearest on."""
    while (part := part.parent()) is not None:
        yield part


def _is_video(clip: Any) -> bool:
    return clip.parent() is None or getattr(clip.parent(), "kind", "Video") == "Video"


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
        if not whole or hours < 0 or not 0 <= frame < round(rate):
            raise ValueError(text)
    except (ValueError, IndexError) as error:
        raise InputError(
            f"{where}: the timecode {text!r} at {rate:g} frames a second; expected HH:MM:SS:FF",
            "VALUES_WRONG",
        ) from error
    nominal = round(rate)
    total = 60 * hours + minutes
    skipped = dropped_labels(total, nominal) if dropped else 0
    return (60 * total + seconds) + (frame - skipped) / nominal


def _library(path: Path) -> Any:
    try:
        import opentimelineio
    except ImportError as error:
        raise PluginError(
            f"{path}: cuts are read by OpenTimelineIO, which is not installed "
            f"({how_to_install('otio')})"
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
