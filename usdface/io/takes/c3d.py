"""C3D marker files, after the C3D User Guide (c3d.org).

Read with numpy and not with a C3D library: only the points are wanted, analog samples
stay on disk, and no count in the file is believed before it is checked against its size.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from usdface.arrays import FloatArray
from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.io.takes.c3d_ignored import report_beside_points, timecode_of
from usdface.io.takes.c3d_parameters import ByteOrder, Parameters, floats, read_parameters
from usdface.io.takes.raw_take import DEFAULTS, RawTake, finish_take
from usdface.options import TakeOptions
from usdface.takes import MarkerTake

__all__ = ["read_c3d"]

# C3D User Guide, "The header section" and, for the processor types, "The parameter section".
_BLOCK = 512  # bytes
_MOST_COUNTED = 65535  # frames, in 16 bits
_KEY = 0x50  # second byte of every C3D file
_ORDERS: dict[int, ByteOrder] = {84: "intel", 85: "dec", 86: "mips"}
# Parameters that list the labels of points that are no places, as Vicon writes computed quantities.
_COMPUTED = tuple(
    f"POINT:{name}" for name in ("ANGLES", "FORCES", "MOMENTS", "POWERS", "REACTIONS", "SCALARS")
)


@dataclass(frozen=True, eq=False, slots=True)
class _Header:
    """The first block as 16-bit words and as floats (word n of the guide is `words[n - 1]`)."""

    order: ByteOrder
    words: list[int]
    floats: FloatArray
    parameters: Parameters


@dataclass(frozen=True, slots=True)
class _Layout:
    """The layout of the points in the file: `frames` frames of `frame_bytes` from `start`."""

    start: int
    frames: int
    markers: int
    frame_bytes: int
    scale: float  # > 0: 2-byte integers times scale; else 4-byte floats
    rate: float
    order: ByteOrder


def read_c3d(path: Path, options: TakeOptions = DEFAULTS) -> tuple[MarkerTake, list[Finding]]:
    """Read the points of a C3D file, in any of its byte orders and number formats.

    A negative residual or a coordinate that is not finite = occluded. Times count from
    the first frame in the file; FRAMES_RENUMBERED has its number where it is not 1. Analog
    channels and events are named (CHANNEL_IGNORED). A file that ends between two frames gives its
    whole frames and FRAMES_MISSING; one that ends within a frame was cut off. Frames behind the
    announced ones are read where their number did not fit its 16 bits, and are else FRAMES_UNREAD:
    a header may leave out the end of a take. Points that the file lists as angles, forces and the
    like are no markers.

    Raises
    ------
    InputError
        If the file is missing, empty, not C3D, damaged, cut off, or never shows a marker.
    """
    if not path.is_file():
        raise InputError(f"no such file: {path}", "FILE_UNREADABLE")
    try:
        data = np.frombuffer(path.read_bytes(), np.uint8)
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror}", "FILE_UNREADABLE") from error
    if not len(data):
        raise InputError(f"{path} is empty; export or copy it again", "FILE_UNREADABLE")
    if len(data) < 2 * _BLOCK or data[1] != _KEY:
        raise InputError(
            f"{path} is not a C3D file, or is cut off within its header; export or copy it again",
            "FILE_UNREADABLE",
        )
    header = _header(path, data)
    parameters = header.parameters
    layout, findings = _layout(path, len(data), header)
    layout, frame_findings = _all_frames(path, data, layout, header)
    findings += frame_findings
    findings += report_beside_points(path, parameters, _analog_count(header, layout.rate))
    timecode, timecode_findings = timecode_of(path, parameters)
    findings += timecode_findings
    first = _first_frame(header)
    if first > 1:
        message = "time 0 is frame {frame_number} of the recording"
        findings.append(finding("FRAMES_RENUMBERED", str(path), message, first))
    up_axis, axis_findings = _up_axis(path, parameters, options)
    labels, positions = _labels(parameters, layout.markers), _points(data, layout)
    if computed := _computed(parameters, labels):
        message = "computed points, such as angles and forces: {channels}"
        findings.append(finding("CHANNEL_IGNORED", str(path), message, computed))
        kept = [i for i, label in enumerate(labels) if label not in computed]
        labels, positions = tuple(labels[i] for i in kept), positions[:, kept]
    raw = RawTake(
        path=path,
        labels=labels,
        positions=positions,
        rate=layout.rate,
        unit_name=_text(parameters, "POINT:UNITS"),
        up_axis=up_axis,
        start_timecode=timecode,
        first_frame=max(first - 1, 0),
    )
    take, take_findings = finish_take(raw, options)
    return take, findings + axis_findings + take_findings


def _header(path: Path, data: NDArray[np.uint8]) -> _Header:
    start = (int(data[0]) - 1) * _BLOCK
    order = _ORDERS.get(int(data[start + 3])) if 0 < start < len(data) - 3 else None
    if order is None:
        raise InputError(
            f"{path}: the C3D parameter section is missing or cut off; export or copy it again",
            "FILE_CUT_OFF",
        )
    first = data[:_BLOCK].tobytes()
    words = np.frombuffer(first, ">u2" if order == "mips" else "<u2").tolist()
    end = (words[8] - 1) * _BLOCK  # where the points begin
    if end <= start:
        end = start + int(data[start + 2]) * _BLOCK
    parameters = read_parameters(path, data[start:end].tobytes(), order)
    with np.errstate(invalid="ignore"):  # most of the block are no floats
        return _Header(order, words, floats(first, order), parameters)


def _layout(path: Path, size: int, header: _Header) -> tuple[_Layout, list[Finding]]:
    """Return where the points lie, checked against the size of the file."""
    words, parameters = header.words, header.parameters
    markers = int(_number(parameters, "POINT:USED", words[1]))
    rate = _number(parameters, "POINT:RATE", header.floats[5])
    scale = _number(parameters, "POINT:SCALE", header.floats[3])
    start = int(words[8] or _number(parameters, "POINT:DATA_START", 0)) * _BLOCK - _BLOCK
    if not (np.isfinite(scale) and markers > 0 and 0 < start < size):
        raise InputError(
            f"{path}: the C3D file has no points, or is cut off before them; "
            "export it with labelled markers",
            "FILE_CUT_OFF",
        )
    values = 4 * markers + _analog_count(header, rate)
    frame_bytes = values * (2 if scale > 0 else 4)
    announced = _frame_count(header)
    held, rest = divmod(size - start, frame_bytes)
    findings = []
    if announced > held:
        if rest or not held:
            raise InputError(
                f"{path} is cut off: the header announces {announced} frames, the file holds "
                f"{held} and a part; export or copy it again",
                "FILE_CUT_OFF",
            )
        message = "the header announces {expected_count} frames, the file holds {frame_count}"
        findings = [finding("FRAMES_MISSING", str(path), message, announced, held)]
    frames = max(0, min(announced, held))
    return _Layout(start, frames, markers, frame_bytes, scale, rate, header.order), findings


def _analog_count(header: _Header, rate: float) -> int:
    """Return the analog values between the points of two frames."""
    channels = _number(header.parameters, "ANALOG:USED", -1)
    if channels < 0:
        return header.words[2]
    samples = _number(header.parameters, "ANALOG:RATE", 0) / rate if rate > 0 else 1
    return int(channels) * max(1, round(min(samples, 1e9)))


def _frame_count(header: _Header) -> int:
    """Return the announced number of frames; 16 bits hold it only up to 65535."""
    parameters = header.parameters
    first = parameters.get("TRIAL:ACTUAL_START_FIELD", [])
    last = parameters.get("TRIAL:ACTUAL_END_FIELD", [])
    if not isinstance(first, list) and not isinstance(last, list) and len(first) == len(last) == 2:
        count = float((last - first) @ [1.0, 65536.0])
        return int(count) + 1 if np.isfinite(count) else 0
    count = _number(parameters, "POINT:LONG_FRAMES", 0) or _number(parameters, "POINT:FRAMES", 0)
    return int(count) or header.words[4] - header.words[3] + 1


def _first_frame(header: _Header) -> int:
    """Return the number of the first frame in the recording, which counts from 1."""
    first = header.parameters.get("TRIAL:ACTUAL_START_FIELD", [])
    if isinstance(first, list) or len(first) != 2 or not np.isfinite(first).all():
        return header.words[3]
    return int(first @ [1.0, 65536.0])


def _all_frames(
    path: Path, data: NDArray[np.uint8], layout: _Layout, header: _Header
) -> tuple[_Layout, list[Finding]]:
    """Add frames behind the announced ones, or report them: more than fills the last block up."""
    end = layout.start + layout.frames * layout.frame_bytes
    parameters = (int(data[0]) - 1) * _BLOCK
    rest = data[end : parameters if parameters > layout.start else len(data)]
    count = len(rest) // layout.frame_bytes
    if len(rest) < _BLOCK or not count or not rest.any():
        return layout, []
    where, announced = str(path), layout.frames
    if not _counter_full(header):
        message = "the header announces {expected_count} frames; {frame_count} more are not read"
        return layout, [finding("FRAMES_UNREAD", where, message, announced, count)]
    used = np.flatnonzero(rest[: count * layout.frame_bytes])[-1] // layout.frame_bytes + 1
    filling = (_BLOCK - 1) // layout.frame_bytes  # frames of zeros that a last block may hold
    whole = replace(layout, frames=announced + max(int(used), count - filling))
    message = "the header announces {expected_count} frames, the most that it can count, the file "
    message += "holds {frame_count}; all are read"
    return whole, [finding("FRAMES_UNANNOUNCED", where, message, announced, whole.frames)]


def _counter_full(header: _Header) -> bool:
    """Return whether the only number of frames is the largest of its 16 bits."""
    others = ("TRIAL:ACTUAL_END_FIELD", "POINT:LONG_FRAMES")
    counted = _number(header.parameters, "POINT:FRAMES", header.words[4])
    return counted == _MOST_COUNTED and not any(key in header.parameters for key in others)


def _points(data: NDArray[np.uint8], layout: _Layout) -> FloatArray:
    """Return positions (F, M, 3) in file units; NaN = the file calls the point invalid."""
    end = layout.start + layout.frames * layout.frame_bytes
    frames = data[layout.start : end].reshape(layout.frames, layout.frame_bytes)
    with np.errstate(invalid="ignore"):  # NaN patterns that signal
        if layout.scale > 0:
            raw = frames[:, : 8 * layout.markers].tobytes()
            dtype = ">i2" if layout.order == "mips" else "<i2"
            values = np.frombuffer(raw, dtype).astype(np.float64)
        else:
            raw = frames[:, : 16 * layout.markers].tobytes()
            values = floats(raw, layout.order)
    values = values.reshape(layout.frames, layout.markers, 4)
    positions, residuals = values[..., :3], values[..., 3]
    unmeasured = np.isnan(residuals) & (positions == 0).all(axis=2)
    if layout.scale > 0:
        positions = positions * layout.scale
    positions[(residuals < 0) | unmeasured] = np.nan
    return positions


def _up_axis(
    path: Path, parameters: Parameters, options: TakeOptions
) -> tuple[str | None, list[Finding]]:
    """Return the axis that points up on screen, as POINT:Y_SCREEN names it.

    Its sign is not followed: files with a real Z up are seen to say "-Z".
    """
    screen = _text(parameters, "POINT:Y_SCREEN").upper()
    axis = screen[-1:]
    if axis not in ("X", "Y", "Z"):
        return None, []
    if axis == "X" and options.up_axis is None:
        raise InputError(
            f"{path}: POINT:Y_SCREEN names an up axis that is not supported, X; "
            "give the up axis, Y or Z",
            "AXIS_UNKNOWN",
        )
    if screen.startswith("-") and options.up_axis is None:
        message = "POINT:Y_SCREEN is {screen_axis}; taken as {axis} up"
        return axis, [finding("UP_AXIS_ASSUMED", str(path), message, screen, axis)]
    return axis, []


def _labels(parameters: Parameters, markers: int) -> tuple[str, ...]:
    """Return one label for each marker, from LABELS, LABELS2, ... (255 each)."""
    labels: list[str] = []
    for key in ["POINT:LABELS", *(f"POINT:LABELS{n}" for n in range(2, 258))]:
        if not (value := _texts(parameters, key)):
            break
        labels += value
    return tuple((labels + [""] * markers)[:markers])


def _computed(parameters: Parameters, labels: tuple[str, ...]) -> list[str]:
    """Return the labels of points that are no places, but angles, forces and the like."""
    computed = {label for key in _COMPUTED for label in _texts(parameters, key) if label}
    return [label for label in labels if label in computed]


def _number(parameters: Parameters, key: str, missing: float) -> float:
    value = parameters.get(key)
    if value is None or isinstance(value, list) or not len(value) or not np.isfinite(value[0]):
        return missing
    return float(value[0])


def _texts(parameters: Parameters, key: str) -> list[str]:
    value = parameters.get(key)
    return value if isinstance(value, list) else []


def _text(parameters: Parameters, key: str) -> str:
    return next(iter(_texts(parameters, key)), "")
