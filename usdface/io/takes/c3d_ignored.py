"""Contents of a C3D file beside its points: timecode, analog channels, events and rotations.

Source: C3D User Guide (c3d.org), "The ANALOG group", "The EVENT group", "The ROTATION group".
"""

import re
from pathlib import Path

from usdface.findings import Finding, finding
from usdface.io.takes.c3d_parameters import Parameters, labels_of, number_of, texts_of

__all__ = ["report_beside_points", "timecode_of"]

_TIMECODE = re.compile(r"\d{1,2}:\d{2}:\d{2}[:;.]\d{1,3}(\.\d+)?")


def timecode_of(path: Path, parameters: Parameters) -> tuple[str, list[Finding]]:
    """Return a text parameter that is called and reads like a timecode; "" if none is.

    The guide names no place for it; systems keep it in groups of their own, some as numbers.
    """
    called = {k: v for k, v in parameters.items() if "TIMECODE" in k or "SMPTE" in k}
    texts = (text for value in called.values() if isinstance(value, list) for text in value)
    found = next(filter(_TIMECODE.fullmatch, texts), "")
    if found or not called:
        return found, []
    message = "a timecode in a form that is not read: {channels}"
    return "", [finding("CHANNEL_IGNORED", str(path), message, list(called))]


def report_beside_points(path: Path, parameters: Parameters, held: int) -> list[Finding]:
    """Return CHANNEL_IGNORED for the contents of a file beside points.

    Parameters
    ----------
    path : Path
    parameters : mapping
    held : int
        Analog values between the points of two frames; 0 = none.
    """
    contents = {
        "analog channels are not read: {channels}": _analog_channels(parameters, held),
        "events are not read: {channels}": _events(parameters),
        "rotations are not read: {channels}": _rotations(parameters),
    }
    return [
        finding("CHANNEL_IGNORED", str(path), message, names)
        for message, names in contents.items()
        if names
    ]


def _used(parameters: Parameters, group: str) -> int:
    """Return how many of a group's entries are in use; 0 where a broken file has no number."""
    used = number_of(parameters, f"{group}:USED", 0)
    return int(used) if 0 <= used < 1 << 16 else 0


def _analog_channels(parameters: Parameters, held: int) -> list[str]:
    """Return the names of the analog channels, as of force plates, muscles and microphones."""
    count = _used(parameters, "ANALOG")
    named = [label for label in labels_of(parameters, "ANALOG")[:count] if label]
    if not held or len(named) == count > 0:
        return named if held else []
    return [*named, f"{count - len(named) if count else held} without a name"]


def _rotations(parameters: Parameters) -> list[str]:
    """Return the names of rotations of segments, as markerless systems write them."""
    count = _used(parameters, "ROTATION")
    named = [label for label in texts_of(parameters, "ROTATION:LABELS")[:count] if label]
    return named + ([f"{count - len(named)} without a name"] if count > len(named) else [])


def _events(parameters: Parameters) -> list[str]:
    """Return the events of a recording with their times [s], as an operator marked them."""
    count = _used(parameters, "EVENT")
    times = parameters.get("EVENT:TIMES")
    names = texts_of(parameters, "EVENT:LABELS")[:count]
    names += ["event"] * (count - len(names))
    if times is None or isinstance(times, list) or len(times) < 2 * count:
        return names
    pairs = times[: 2 * count].reshape(count, 2)  # whole minutes, and seconds
    return [
        f"{name} at {60 * minutes + seconds:.2f} s"
        for name, (minutes, seconds) in zip(names, pairs.tolist(), strict=True)
    ]
