"""Frame times of a take, from a time column, frame numbers or a rate."""

from pathlib import Path

import numpy as np

from usdface.arrays import FloatArray
from usdface.errors import InputError
from usdface.findings import Finding, finding

__all__ = ["ASSUMED_RATE", "check_timecode", "nominal_rate", "take_times"]

ASSUMED_RATE = 30.0  # Hz, where neither file nor options name one; RATE_ASSUMED reports it
_SLOWEST, _FASTEST = 1e-3, 1e6  # Hz: a frame in 17 minutes to a frame in a microsecond
_SLOWEST_TIMECODE = 24  # frames a second, as film counts
_LONGEST = 1e7  # s, four months
_GRID_TOLERANCE = 0.1  # frames: times rounded to milliseconds are off by that at 200 Hz
_WHOLE_RATE_TOLERANCE = 5e-4  # half of the way from 30 to 29.97 Hz
# A rate that the file names and that of its times agree within this share, unless the steps of the
# times are irregular: no more than nine in ten are alike. Set by hand.
_RATE_TOLERANCE, _REGULAR = 0.1, 0.9
# Film at NTSC's rate, and as headers write it, in C3D in single precision; 0.6 s in an hour.
_FILM, _ROUNDED_FILM, _SINGLE = 24 / 1.001, 23.98, 1e-5


def nominal_rate(seconds: FloatArray) -> float:
    """Return the frame rate [Hz] that increasing times (F,) [s] stand for; 0 if F < 2.

    The mean of the steps that are not gaps, so that neither dropped frames nor times
    rounded to milliseconds bend it.
    """
    steps = np.diff(seconds)
    if not len(steps):
        return 0.0
    rate = float(1.0 / steps[steps <= 1.5 * np.median(steps)].mean())
    return float(round(rate)) if abs(rate - round(rate)) < _WHOLE_RATE_TOLERANCE * rate else rate


def check_timecode(path: Path, timecode: str, rate: float) -> None:
    """Refuse a timecode whose frame a second of the take has not.

    A take of more frames a second than its timecode counts may have any of these; one of fewer
    than any timecode counts, as of a slow web camera, has that of another clock.

    Parameters
    ----------
    path : Path
        File that the message names.
    timecode : str
        ``HH:MM:SS:FF``, perhaps with a fraction of a frame; "" = none.
    rate : float [Hz]
        Of the take.

    Raises
    ------
    InputError
        If the frame is at or beyond the whole frames of a second.
    """
    count = round(rate)
    frame = float(timecode.replace(";", ":").split(":")[-1] or 0.0)
    if count >= _SLOWEST_TIMECODE and frame >= count:
        raise InputError(
            f"{path}: the start timecode {timecode} has frame {frame:g}; expected 0 to "
            f"{count - 1}, of {rate:g} frames a second; correct --start-timecode, or --rate",
            "SETTING_WRONG",
        )


def take_times(
    path: Path,
    count: int,
    *,
    rate: float = 0.0,
    seconds: FloatArray | None = None,
    frames: FloatArray | None = None,
    override: float | None = None,
) -> tuple[FloatArray, float, list[Finding]]:
    """Return times (F,) [s] from 0, the nominal rate [Hz] and findings.

    Parameters
    ----------
    path : Path
        File that the messages name.
    count : int
        F, the number of frames.
    rate : float [Hz]
        Rate that the file names; 0 = none. Regular times of another rate count, not it. 23.98 is
        24000/1001, here and as `override`.
    seconds : (F,) float [s], optional
        The file's time column, from any origin. Times that lie on the grid of the rate
        within a tenth of a frame are the grid's.
    frames : (F,) float, optional
        Frame numbers, used where there is no time column.
    override : float [Hz], optional
        The rate that holds instead of the file's; times stretch accordingly.

    Raises
    ------
    InputError
        If there is no frame, or times do not increase by a microsecond or more.
    """
    if count == 0:
        raise InputError(
            f"{path}: there are no frames of data; expected at least one", "TAKE_EMPTY"
        )
    if override is not None and not _SLOWEST <= override <= _FASTEST:
        raise InputError(
            f"{path}: a rate of {override} Hz is requested; expected 0.001 to 1000000",
            "SETTING_WRONG",
        )
    rate = _unrounded(rate) if _SLOWEST <= rate <= _FASTEST else 0.0
    override = None if override is None else _unrounded(override)
    if seconds is not None:
        seconds, rate, findings = _of_times(path, seconds, rate, override)
    else:
        findings = []
        if not (rate or override):
            findings = [finding("RATE_ASSUMED", str(path), "taken as {rate_hz:g} Hz", ASSUMED_RATE)]
        rate = rate or override or ASSUMED_RATE
        numbers = np.arange(count) if frames is None else _from_zero(path, frames, "frame number")
        seconds = numbers / rate
    exact = seconds * rate
    grid = np.round(exact)
    if rate and _on_grid(seconds, rate) and (np.diff(grid) > 0).all():
        seconds = grid / rate
    missing = int(np.maximum(np.round(np.diff(exact)) - 1, 0).sum())
    if missing:
        message = (
            "{missing_count} frames are missing between the {frame_count} recorded ones; "
            "times are kept"
        )
        findings.append(finding("FRAMES_DROPPED", str(path), message, missing, count))
    if override and rate:
        return seconds * (rate / override), override, findings
    return seconds, rate, findings


def _unrounded(rate: float) -> float:
    return _FILM if abs(rate - _ROUNDED_FILM) < _SINGLE else rate


def _of_times(
    path: Path, seconds: FloatArray, rate: float, override: float | None
) -> tuple[FloatArray, float, list[Finding]]:
    """Return times (F,) [s] from 0 on, the rate [Hz] that they have, and findings.

    `rate` is that of the file, 0 = not named.
    """
    seconds = _from_zero(path, seconds, "time")
    own = nominal_rate(seconds)
    if own > _FASTEST:
        raise InputError(
            f"{path}: frames follow each other after {1 / own:.3g} s; expected a microsecond "
            "or more, so the times are in another unit than seconds",
            "TIMES_WRONG",
        )
    findings = []
    if rate and _agree(1000.0 * own, rate):
        message = "at {named_hz:g} Hz its times are milliseconds, not seconds; read as such"
        findings = [finding("TIMES_IN_MILLISECONDS", str(path), message, rate)]
        seconds, own = seconds / 1000.0, 1000.0 * own
    elif rate and _contradicts(seconds, own, rate):
        message = "its times step at {times_hz:g} Hz, not at {named_hz:g}; the times count"
        if override is None:
            findings = [finding("RATE_CONTRADICTED", str(path), message, own, rate)]
        rate = own
    return seconds, rate or own or (override or 0.0), findings


def _contradicts(seconds: FloatArray, own: float, rate: float) -> bool:
    """Return whether times step at a rate of `own` [Hz], and not at that of the file.

    Rates as close as 59.94 and 60 Hz are told apart where the take is long enough for it.
    """
    apart = not _agree(own, rate) or (_on_grid(seconds, own) and not _on_grid(seconds, rate))
    return apart and _is_regular(seconds, own)


def _on_grid(seconds: FloatArray, rate: float) -> bool:
    exact = seconds * rate
    return bool(np.abs(exact - np.round(exact)).max() < _GRID_TOLERANCE)


def _agree(own: float, rate: float) -> bool:
    return abs(own / rate - 1.0) < _RATE_TOLERANCE


def _is_regular(seconds: FloatArray, own: float) -> bool:
    """Return whether times step at a rate of `own` [Hz], but for a few."""
    steps = np.diff(seconds) * own
    return len(steps) > 1 and bool((np.abs(steps - 1.0) < _RATE_TOLERANCE).mean() > _REGULAR)


def _from_zero(path: Path, values: FloatArray, subject: str) -> FloatArray:
    if not np.isfinite(values).all():
        at = int(np.argmin(np.isfinite(values)))
        raise InputError(
            f"{path}: frame {at} of the data has no {subject}; fill in the cell, or delete the row",
            "TIMES_WRONG",
        )
    later = values[1:] > values[:-1]
    if not later.all():
        at = int(np.argmin(later)) + 1
        remedy = "delete or sort the rows"
        if at > 1 and values[at] <= values[0]:
            remedy = "it begins anew: make a file of each of the joined takes"
        raise InputError(
            f"{path}: the {subject} does not increase at frame {at} of the data "
            f"({values[at - 1]:g}, then {values[at]:g}); {remedy}",
            "TIMES_WRONG",
        )
    if values[-1] / 2 - values[0] / 2 > _LONGEST / 2:
        raise InputError(
            f"{path}: the {subject} runs from {values[0]:g} to {values[-1]:g}; too far",
            "TIMES_WRONG",
        )
    shifted: FloatArray = values - values[0]
    return shifted
