"""The header of a C3D file: the order of its bytes, and where its points lie.

Source: C3D User Guide (c3d.org), "The header section". No count in the file is believed before it
is checked against its size.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from usdface.arrays import FloatArray
from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.io.takes.c3d_parameters import (
    ByteOrder,
    Parameters,
    floats,
    number_of,
    read_parameters,
)

__all__ = ["C3dHeader", "PointLayout", "analog_count", "point_layout", "read_header"]

_BLOCK = 512  # bytes
_MOST_COUNTED = 65535  # frames, in 16 bits
_KEY = 0x50  # second byte of every C3D file
# Processor types, after "The parameter section".
_ORDERS: dict[int, ByteOrder] = {84: "intel", 85: "dec", 86: "mips"}


@dataclass(frozen=True, eq=False, slots=True)
class C3dHeader:
    """The first block as 16-bit words and as floats (word n of the guide is `words[n - 1]`)."""

    order: ByteOrder
    words: list[int]
    floats: FloatArray
    parameters: Parameters


@dataclass(frozen=True, slots=True)
class PointLayout:
    """The layout of the points in the file: `frames` frames of `frame_bytes` from `start`."""

    start: int
    first_frame: int  # its number in the recording, which counts from 1
    frames: int
    markers: int
    frame_bytes: int
    scale: float  # > 0: 2-byte integers times scale; else 4-byte floats
    rate: float
    order: ByteOrder


def read_header(path: Path, data: NDArray[np.uint8]) -> C3dHeader:
    """Read the header and the parameters of a file, given as its bytes.

    Raises
    ------
    InputError
        If it is no C3D file, or its parameters are missing, damaged or cut off.
    """
    if len(data) < 2 * _BLOCK or data[1] != _KEY:
        raise InputError(
            f"{path} is not a C3D file, or is cut off within its header; export or copy it again",
            "FILE_UNREADABLE",
        )
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
        return C3dHeader(order, words, floats(first, order), parameters)


def point_layout(
    path: Path, data: NDArray[np.uint8], header: C3dHeader
) -> tuple[PointLayout, list[Finding]]:
    """Return where the points lie, checked against the size of the file.

    FRAMES_MISSING, FRAMES_UNREAD and FRAMES_UNANNOUNCED where it holds other frames than announced.

    Raises
    ------
    InputError
        If there are no points, or the file ends within a frame.
    """
    layout, findings = _announced_layout(path, len(data), header)
    layout, more = _with_unannounced_frames(path, data, layout, header)
    return layout, findings + more


def _announced_layout(
    path: Path, size: int, header: C3dHeader
) -> tuple[PointLayout, list[Finding]]:
    words, parameters = header.words, header.parameters
    markers = int(number_of(parameters, "POINT:USED", words[1]))
    rate = number_of(parameters, "POINT:RATE", header.floats[5])
    scale = number_of(parameters, "POINT:SCALE", header.floats[3])
    start = int(words[8] or number_of(parameters, "POINT:DATA_START", 0)) * _BLOCK - _BLOCK
    if not (np.isfinite(scale) and markers > 0 and 0 < start < size):
        raise InputError(
            f"{path}: the C3D file has no points, or is cut off before them; "
            "export it with labelled markers",
            "FILE_CUT_OFF",
        )
    values = 4 * markers + analog_count(header, rate)
    frame_bytes = values * (2 if scale > 0 else 4)
    ranges = _frame_ranges(header)
    held, rest = divmod(size - start, frame_bytes)
    # Programs that cut or join a recording leave some of the numbers as they were. The last block
    # is filled up; ezc3d adds a whole one to a full one.
    fitting = (r for r in ranges if 0 <= size - start - r[1] * frame_bytes <= _BLOCK)
    first_frame, announced = next(fitting, ranges[0])
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
    return (
        PointLayout(start, first_frame, frames, markers, frame_bytes, scale, rate, header.order),
        findings,
    )


def analog_count(header: C3dHeader, rate: float) -> int:
    """Return the analog values between the points of two frames."""
    channels = number_of(header.parameters, "ANALOG:USED", -1)
    if channels < 0:
        return header.words[2]
    samples = number_of(header.parameters, "ANALOG:RATE", 0) / rate if rate > 0 else 1
    return int(channels) * max(1, round(min(samples, 1e9)))


def _frame_ranges(header: C3dHeader) -> list[tuple[int, int]]:
    """Return the number of the first frame and of frames, each time that the file states them.

    Those come first that count beyond 65535, the most that 16 bits hold.
    """
    parameters, words = header.parameters, header.words
    first = _of_two_words(parameters, "TRIAL:ACTUAL_START_FIELD")
    last = _of_two_words(parameters, "TRIAL:ACTUAL_END_FIELD")
    ranges = [] if first is None or last is None else [(first, last - first + 1)]
    for key in ("POINT:LONG_FRAMES", "POINT:FRAMES"):
        ranges.append((words[3], int(number_of(parameters, key, 0))))
    ranges.append((words[3], words[4] - words[3] + 1))
    return [each for each in ranges if each[1] > 0] or ranges[-1:]


def _of_two_words(parameters: Parameters, key: str) -> int | None:
    value = parameters.get(key, [])
    if isinstance(value, list) or len(value) != 2 or not np.isfinite(value).all():
        return None
    return int(value @ [1.0, 65536.0])


def _with_unannounced_frames(
    path: Path, data: NDArray[np.uint8], layout: PointLayout, header: C3dHeader
) -> tuple[PointLayout, list[Finding]]:
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


def _counter_full(header: C3dHeader) -> bool:
    """Return whether the only number of frames is the largest of its 16 bits."""
    others = ("TRIAL:ACTUAL_END_FIELD", "POINT:LONG_FRAMES")
    counted = number_of(header.parameters, "POINT:FRAMES", header.words[4])
    return counted == _MOST_COUNTED and not any(key in header.parameters for key in others)
