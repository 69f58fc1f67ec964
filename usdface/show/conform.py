"""Conforming takes to a cut: the take and the range of each clip, by timecode."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Any

from usdface.findings import Finding, finding
from usdface.io.cut_file import CutEvent

__all__ = ["TakeClock", "conformed"]

_ROUNDING = 0.01  # frames of the cut


@dataclass(frozen=True, slots=True)
class TakeClock:
    """The timecodes of a take.

    Attributes
    ----------
    file : Path
    source : str
        Name of the recording.
    start : float [s]
        Timecode of its first frame, as frames over the whole frames a second that it counts.
    duration : float [s]
        From first to last frame, in real time.
    rate : float [Hz]
    """

    file: Path
    source: str
    start: float
    duration: float
    rate: float

    @property
    def names(self) -> tuple[str, str]:
        """The names that a cut may call it by, in small letters."""
        return self.file.stem.lower(), Path(self.source).stem.lower()


def conformed(
    events: Sequence[CutEvent], takes: Sequence[TakeClock], handles: int, rate: float
) -> tuple[list[dict[str, Any]], list[Finding]]:
    """Return the entries of a show file for the clips of a cut.

    A clip is of the take whose timecodes hold it; where several do, of the one that its media name,
    else of none. Frames of a clip outside the take are reported.

    Parameters
    ----------
    events : sequence of CutEvent
    takes : sequence of TakeClock
    handles : int
        Additional frames on both sides.
    rate : float [Hz]
        Of the deliverables; 0: each clip's own.

    Returns
    -------
    list of dict
        ``name``, ``take`` (a path) and ``process``, whose ``deliver`` has range and rate.
    list of Finding
    """
    entries: list[dict[str, Any]] = []
    findings: list[Finding] = []
    titles = {_title(event, number) for number, event in enumerate(events)}
    used: set[str] = set()
    for number, event in enumerate(events):
        title = _title(event, number)
        take, found = _take_of(event, takes, title)
        findings += found
        if take is None:
            continue
        name = next(name for name in _numbered(title) if name not in used | (titles - {title}))
        used.add(name)
        begin = _after(take, event)
        frames = rate or event.rate
        first, length = begin * frames, event.frames * frames / event.rate
        if abs(first - round(first)) > _ROUNDING:
            message = (
                "the cut begins between two frames of the deliverable, {shift_s:.3f} s off; it "
                "is moved there"
            )
            shift = (round(first) - first) / frames
            findings.append(finding("CUT_BETWEEN_FRAMES", name, message, shift))
        deliver = {
            "start": round(first),
            "end": round(first) + max(1, round(length)) - 1,
            "rate": frames,
        }
        deliver |= {"handles": handles} if handles else {}
        entries.append({"name": name, "take": take.file, "process": {"deliver": deliver}})
    return entries, findings


def _numbered(title: str) -> Iterator[str]:
    """Yield a name, and the same with numbers behind it."""
    yield title
    yield from (f"{title}_{number}" for number in count(2))


def _after(take: TakeClock, event: CutEvent) -> float:
    """Return how long after the first frame of a take a clip begins [s].

    Timecode counts whole frames a second, and frames of 23.976 Hz last longer than those.
    """
    return (event.start - take.start) * round(event.rate) / event.rate


def _take_of(
    event: CutEvent, takes: Sequence[TakeClock], title: str
) -> tuple[TakeClock | None, list[Finding]]:
    """Return the take of a clip."""
    length = (event.frames - 1) / event.rate

    def held(take: TakeClock) -> float:
        first = _after(take, event)
        return min(first + length, take.duration) - max(first, 0.0)

    slack = 0.5 / event.rate
    known = {name.lower() for name in event.media}
    there = [take for take in takes if held(take) >= -slack]
    whole = [take for take in there if held(take) >= length - slack]
    named = [take for take in there if known & set(take.names)]
    for some in (named, whole, there):
        if len(some) == 1:
            return some[0], []
        if len(some) > 1:
            message = "several takes have its timecodes: {names}; the cut names none of them"
            names = [take.file.name for take in some]
            return None, [finding("CUT_TAKE_AMBIGUOUS", title, message, names)]
    return None, [finding("CUT_TAKE_MISSING", title, "no take has the timecodes of the clip")]


def _title(event: CutEvent, number: int) -> str:
    """Return a name for the shot of a clip, which can be that of a file."""
    wanted = event.name or (event.media[0] if event.media else f"clip_{number + 1:03}")
    plain = "".join(c if c.isalnum() or c in "._-" else "_" for c in Path(wanted).stem)
    return plain.strip("._") or f"clip_{number + 1:03}"
