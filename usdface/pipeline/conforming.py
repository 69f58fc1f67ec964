"""Conforming takes to a cut: `usdface conform`, which writes a show file."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from usdface.arguments import checked
from usdface.blas_threads import one_blas_thread
from usdface.errors import InputError, did_you_mean
from usdface.findings import Finding, finding
from usdface.io.atomic import StrPath, write_text
from usdface.io.cut_file import read_cut, timecode_seconds
from usdface.io.inputs import check_outputs, files_read
from usdface.io.takes.usd_take import read_usd_take
from usdface.options import TakeOptions
from usdface.pipeline.schemas import register_schemas
from usdface.progress import OnProgress, Progress
from usdface.result import Result
from usdface.show.conform import TakeClock, conformed
from usdface.show.show_file import read_show_file, show_document

__all__ = ["conform"]

_MOST_COUNTED = 60  # frames a second, by timecode of video (SMPTE ST 12-1)


@checked
@one_blas_thread()
def conform(
    cut: StrPath,
    takes: Sequence[StrPath],
    output: StrPath,
    *,
    show: StrPath | None = None,
    performer: str = "",
    characters: Sequence[str] = (),
    handles: int = 0,
    rate: float = 0.0,
    timecode_rate: float = 0.0,
    cut_rate: float = 0.0,
    on_progress: OnProgress | None = None,
) -> Result[None]:
    """Write a show file with a shot for each clip of a cut: which range of which take, by timecode.

    Parameters
    ----------
    cut : path
        .otio, or .edl; read by OpenTimelineIO (``pip install 'usdface[otio]'``).
    takes : sequence of path
        USD takes that know the timecode of their first frame.
    output : path
        The show file, .json, for `process_sequence`.
    show : path, optional
        A show file in the same folder, whose characters, performers and options are copied.
    performer : str
        Of all shots; "" = none.
    characters : sequence of str
        A shot is made for each.
    handles : int
        Additional frames on both sides of each clip.
    rate : float [Hz]
        Of the deliverables; 0: each clip's own.
    timecode_rate : float [Hz]
        Of the timecodes of the takes; 0: that of each take.
    cut_rate : float [Hz]
        Of the timecodes of an .edl, which do not state it; 0: 24, or 29.97 with drop-frame
        timecode.
    on_progress : callable, optional

    Returns
    -------
    Result of None
        Keys of the summary: ``clips``, ``shots``, ``takes``.

    Raises
    ------
    InputError
        If the cut or a take cannot be read, or no clip has a take.
    PluginError
        If OpenTimelineIO is not installed.

    Examples
    --------
    >>> try:
    ...     usdface.conform("reel.mov", ["examples/take.usdc"], "reel.json")
    ... except usdface.InputError as error:
    ...     print(error.code)
    FILE_KIND_UNKNOWN
    """
    register_schemas()
    progress = Progress.of(on_progress)
    place, base = Path(output), Path(show) if show else None
    if place.suffix.lower() != ".json":
        raise InputError(
            f"cannot write {place}: a show file is JSON; end its name in .json", "FILE_KIND_UNKNOWN"
        )
    if base and base.resolve().parent != place.resolve().parent:
        raise InputError(f"{place} must be beside {base}, whose names it keeps", "SETTING_WRONG")
    if min(handles, rate, timecode_rate, cut_rate) < 0:
        raise InputError("a rate or the handles are negative; expected 0 or more", "SETTING_WRONG")
    with progress.step("read"):
        others = [Path(cut), *([base] if base else [])]
        check_outputs([place], {file: file for file in (*others, *files_read(*map(Path, takes)))})
        events, findings = read_cut(Path(cut), cut_rate)
        read = [_clock(Path(take), timecode_rate) for take in takes]
        clocks = [clock for clock, _ in read]
        findings += [each for _, guessed in read for each in guessed]
        document = _document(base)
        if base is not None:
            _check_named(document, base, "performers", [performer] if performer else [])
            _check_named(document, base, "characters", characters)
        entries, found = conformed(events, clocks, handles, rate)
    if not entries:
        raise InputError(
            f"no clip of {cut} has a take: clips of the cut begin at {_span(events)}, the takes at "
            f"{_span(clocks)}",
            "FRAMES_OUTSIDE",
        )
    shared: dict[str, Any] = {"performer": performer} if performer else {}
    if len(characters) == 1:
        shared["character"] = characters[0]
    elif characters:
        shared["characters"] = list(characters)
    folder = place.resolve().parent
    shots = [
        {**entry, "take": _relative(entry["take"].resolve(), folder), **shared} for entry in entries
    ]
    document["shots"] = shots
    with progress.step("write"):
        write_text(place, json.dumps(document, indent=1, ensure_ascii=False) + "\n")
    summary = {"clips": len(events), "shots": len(shots), "takes": len(clocks)}
    return Result(None, (place,), (*findings, *found), summary, seconds=progress.seconds)


def _document(base: Path | None) -> dict[str, Any]:
    """Return the contents of a show file without its shots."""
    if base is None:
        return {}
    read_show_file(base)  # refuses unknown keys
    return {key: value for key, value in show_document(base).items() if key != "shots"}


def _check_named(document: dict[str, Any], base: Path, kind: str, names: Sequence[str]) -> None:
    """Refuse performers or characters that the show file does not have: a sequence would."""
    for name in names:
        if name not in (known := document.get(kind, {})):
            raise InputError(
                f"{base}: there is no {kind[:-1]} {name!r}{did_you_mean(name, known)}",
                "SETTING_WRONG",
            )


def _clock(path: Path, timecode_rate: float) -> tuple[TakeClock, list[Finding]]:
    """Return the timecodes of a take; RATE_ASSUMED where video has none of as many frames."""
    take, _ = read_usd_take(path, TakeOptions())
    if not take.start_timecode:
        raise InputError(
            f"{path} has no timecode of its first frame; name it: usdface take "
            "--start-timecode 01:00:00:00, or set usdface:startTimecode on its prim",
            "TIMES_WRONG",
        )
    start = timecode_seconds(take.start_timecode, timecode_rate or take.rate, str(path))
    clock = TakeClock(path, take.source, start, float(take.times[-1]), take.rate)
    if timecode_rate or take.rate <= _MOST_COUNTED or start.is_integer():
        return clock, []
    message = (
        "its timecode {timecode} taken to count {rate_hz:g} frames a second, as the take has; "
    )
    message += "one of video counts fewer: --timecode-rate"
    where, code = str(path), take.start_timecode
    return clock, [finding("RATE_ASSUMED", where, message, code, take.rate)]


def _relative(path: Path, folder: Path) -> str:
    return path.relative_to(folder).as_posix() if path.is_relative_to(folder) else str(path)


def _span(parts: Sequence[Any]) -> str:
    """Return the timecodes of the first and the last of them, to the second."""
    if not parts:
        return "none"
    starts = [int(part.start) for part in parts]
    first, last = (
        f"{start // 3600:02}:{start // 60 % 60:02}:{start % 60:02}"
        for start in (min(starts), max(starts))
    )
    return first if first == last else f"{first} to {last}"
