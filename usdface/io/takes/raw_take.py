"""Conversion of recorded markers to a `MarkerTake`: units, axes, labels, occlusion.

Every reader hands its numbers over as a `RawTake`, unconverted; defaults, overrides by the
options and findings are decided here, once for all formats.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from usdface.arguments import checked
from usdface.arrays import BoolArray, FloatArray
from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.geometry.units_and_axes import METERS_PER_UNIT, in_metres
from usdface.io.takes.origin_markers import find_unseen
from usdface.io.takes.repeated_frames import report_repeated_frames
from usdface.io.takes.take_size import report_take_size
from usdface.io.takes.timing import take_times
from usdface.options import TakeOptions
from usdface.takes import FARTHEST, MarkerTake

__all__ = ["DEFAULTS", "RawTake", "check_size", "find_occlusion", "finish_take"]

DEFAULTS = TakeOptions()
_HEADROOM = 16 * 2**20  # bytes that any file may take: tables with few positions are sparse
_EXPANSION = 64  # bytes of positions for a byte of file; dense text gives about 3


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class RawTake:
    """Markers as they stand in their file.

    Attributes
    ----------
    path : Path
        The file.
    labels : tuple of str, length M
        As written: perhaps empty, repeated or prefixed.
    positions : (F, M, 2 or 3) float64
        In the file's unit and axes; two components are pixels, y down. A component that is
        not finite = occluded.
    seconds, frames : (F,) float64, optional
        Time column [s] and frame numbers, from any origin.
    rate : float [Hz]
        0 = the file does not say.
    unit : float [m], optional
        None = `unit_name` counts.
    unit_name : str
        The file's word for its unit, known or not; "" = the file does not say.
    assumed_unit : {"mm", "cm", "m"}
        The usual unit of the format, for a file without a known one.
    up_axis : {"Y", "Z"}, optional
        None = the file does not say.
    start_timecode : str
        "" = the file has none.
    first_frame : int
        Number of frames of the footage before the first one.
    diameters : (M,) float64 [px], optional
        Of painted dots in an image.
    deviation : float [px]
        Standard deviation of a coordinate in an image; 0 = unknown.
    computed : bool
        Joints of a skeleton, of which none can be lost.

    Examples
    --------
    >>> Path("face.xyz").write_text("...")
    3
    >>> raw = usdface.RawTake(
    ...     path=Path("face.xyz"), labels=("chin",), positions=np.zeros((2, 1, 3)), rate=60.0
    ... )
    >>> raw.assumed_unit
    'mm'
    """

    path: Path
    labels: tuple[str, ...]
    positions: FloatArray
    seconds: FloatArray | None = None
    frames: FloatArray | None = None
    rate: float = 0.0
    unit: float | None = None
    unit_name: str = ""
    assumed_unit: str = "mm"
    up_axis: str | None = None
    start_timecode: str = ""
    first_frame: int = 0
    diameters: FloatArray | None = None
    deviation: float = 0.0
    computed: bool = False


@checked
def check_size(path: Path, frame_count: int, marker_count: int) -> None:
    """Refuse positions out of all proportion to their file, before they are allocated.

    Parameters
    ----------
    path : Path
        The file, or a folder of files.
    frame_count, marker_count : int
        As the file announces them.

    Raises
    ------
    InputError
        If (F, M, 3) floats would take far more memory than a file of this size can mean.

    Examples
    --------
    >>> Path("face.xyz").write_text("...")
    3
    >>> usdface.check_size(Path("face.xyz"), 10**9, 40)
    Traceback (most recent call last):
    usdface.errors.InputError: ...cannot come from a file of 3 bytes...
    """
    files = path.iterdir() if path.is_dir() else (path,)
    size = sum(file.stat().st_size for file in files)
    if frame_count * marker_count * 24 > _HEADROOM + _EXPANSION * size:
        raise InputError(
            f"{path}: {frame_count} frames of {marker_count} markers cannot come from "
            f"a file of {size} bytes; is it damaged?",
            "TOO_LARGE",
        )


@checked
def finish_take(raw: RawTake, options: TakeOptions) -> tuple[MarkerTake, list[Finding]]:
    """Return the take in metres, Y up, with unique labels; occlusion is NaN throughout.

    A marker that is never visible is left out.

    Parameters
    ----------
    raw : RawTake
    options : TakeOptions
        They override the file.

    Returns
    -------
    MarkerTake
    list of Finding

    Raises
    ------
    InputError
        If there is no frame or marker, nothing is ever visible, times do not increase, or
        a 3D take is requested of two coordinates.

    Examples
    --------
    >>> Path("face.xyz").write_text("...")
    3
    >>> raw = usdface.RawTake(
    ...     path=Path("face.xyz"), labels=("chin",), positions=np.zeros((2, 1, 3)), rate=60.0
    ... )
    >>> take, _ = usdface.finish_take(raw, usdface.TakeOptions())
    >>> take.names, take.rate
    (('chin',), 60.0)
    """
    path = raw.path
    if not raw.labels:
        raise InputError(f"{path}: there are no markers; expected at least one", "TAKE_EMPTY")
    labels, findings = _unique_labels(path, raw.labels)
    times, rate, new_findings = take_times(
        path,
        len(raw.positions),
        rate=raw.rate,
        seconds=raw.seconds,
        frames=raw.frames,
        override=options.rate,
    )
    findings += new_findings
    positions, unit, up_axis, new_findings = _in_metres(raw, options)
    findings += new_findings
    far = np.any(np.isfinite(positions) & (np.abs(positions) > FARTHEST), axis=2)
    if far.any():
        space = "{place_count} places beyond {limit_km:g} km are taken as occluded", FARTHEST / 1000
        image = "{place_count} places beyond {limit_px:g} px are taken as occluded", FARTHEST
        message, limit = image if positions.shape[2] == 2 else space
        findings.append(finding("MARKER_SPIKE", str(path), message, far.sum(), limit))
    occluded = far | np.any(~np.isfinite(positions), axis=2)
    positions[occluded] = np.nan
    if positions.shape[2] == 3:
        if not raw.computed:
            unseen, new_findings = find_unseen(path, labels, positions)
            occluded[unseen], positions[unseen] = True, np.nan
            findings += new_findings + report_repeated_frames(path, positions)
        findings += report_take_size(path, positions, unit)
    seen, occlusion = find_occlusion(path, labels, occluded)
    findings += occlusion
    take = MarkerTake(
        names=tuple(labels),
        times=times,
        positions=positions,
        rate=rate,
        meters_per_unit=unit,
        up_axis=up_axis,
        start_timecode=raw.start_timecode,
        image_size=options.image_size if positions.shape[2] == 2 else None,
        source=path.name,
        focal_length=(options.focal_length or 0.0) if positions.shape[2] == 2 else 0.0,
        first_frame=raw.first_frame,
        diameters=raw.diameters if positions.shape[2] == 2 else None,
        deviation=raw.deviation if positions.shape[2] == 2 else 0.0,
    )
    return take if seen.all() else take.with_markers(seen), findings


def _unique_labels(path: Path, labels: tuple[str, ...]) -> tuple[list[str], list[Finding]]:
    """Shorten `subject:label` where that stays unique; name the nameless and the repeated."""
    given = [label.strip() or f"marker_{i + 1}" for i, label in enumerate(labels)]
    short = [label.rpartition(":")[2].strip() for label in given]
    uses = Counter(short)
    given = [s if s and uses[s] == 1 else g for s, g in zip(short, given, strict=True)]
    taken = set(given)
    seen: Counter[str] = Counter()
    unique: list[str] = []
    for label in given:
        seen[label] += 1
        name = label
        if seen[label] > 1:
            while (name := f"{label}_{seen[label]}") in taken:
                seen[label] += 1
        taken.add(name)
        unique.append(name)
    changes: dict[str, list[str]] = {"LABEL_CHANGED": [], "LABEL_REPEATED": []}
    for label, numbered, name in zip(labels, given, unique, strict=True):
        if label.strip() != name:
            code = "LABEL_CHANGED" if numbered == name else "LABEL_REPEATED"
            changes[code].append(f"{label!r} to {name!r}")
    message = {
        "LABEL_CHANGED": "labels changed: {changes}",
        "LABEL_REPEATED": "markers have the label of another one; renamed: {changes}",
    }
    found = [finding(code, str(path), message[code], of) for code, of in changes.items() if of]
    return unique, found


def _in_metres(raw: RawTake, options: TakeOptions) -> tuple[FloatArray, float, str, list[Finding]]:
    """Return a copy of the positions in metres, Y up, metres per unit, up axis, findings."""
    where = str(raw.path)
    if options.dimension == 3 and raw.positions.shape[2] == 2:
        raise InputError(f"{where}: only x and y are there; a 3D take needs z", "COLUMNS_WRONG")
    if options.dimension == 2 or raw.positions.shape[2] == 2:
        return raw.positions[..., :2] * [1.0, -1.0], 1.0, "Y", []
    findings = []
    unit = METERS_PER_UNIT[options.units] if options.units else raw.unit
    if unit is None:
        unit = METERS_PER_UNIT.get(raw.unit_name.lower())
    if unit is None:
        unit = METERS_PER_UNIT[raw.assumed_unit]
        findings.append(_assumed(where, raw))
    up_axis = options.up_axis or raw.up_axis
    if up_axis is None:
        up_axis = "Y"
        findings.append(finding("UP_AXIS_ASSUMED", where, "taken as Y up"))
    return in_metres(raw.positions, unit, up_axis), unit, up_axis, findings


def _assumed(where: str, raw: RawTake) -> Finding:
    if not raw.unit_name:
        return finding("UNITS_ASSUMED", where, "taken as {unit}", raw.assumed_unit)
    message = "{found!r} is no known unit of length; taken as {unit}"
    return finding("UNITS_ASSUMED", where, message, raw.unit_name, raw.assumed_unit)


def find_occlusion(
    path: Path, labels: Sequence[str], occluded: BoolArray
) -> tuple[BoolArray, list[Finding]]:
    """Return which markers are ever visible (M,), and where markers (F, M) are occluded.

    Raises
    ------
    InputError
        If nothing is ever visible.
    """
    if occluded.all():
        raise InputError(
            f"{path}: no marker is visible in any frame; "
            "expected a position at least once: are the labels right?",
            "TAKE_EMPTY",
        )
    frame_count, findings = len(occluded), []
    counts = occluded.sum(axis=0).tolist()
    # The report prints the first of many.
    for label, count in sorted(zip(labels, counts, strict=True), key=lambda each: -each[1]):
        where = f"{path}: {label}"
        if count == frame_count:
            findings.append(finding("MARKER_NEVER_SEEN", where))
        elif count:
            message = "occluded in {occluded_count} of {frame_count} frames"
            findings.append(finding("MARKER_OCCLUDED", where, message, count, frame_count))
    empty = np.flatnonzero(occluded.all(axis=1))
    if len(empty):
        message = "no marker is visible in frames {frames}"
        findings.append(finding("FRAME_EMPTY", str(path), message, empty.tolist()))
    return np.any(~occluded, axis=0), findings
