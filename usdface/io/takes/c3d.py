"""C3D marker files, after the C3D User Guide (c3d.org).

Read with numpy and not with a C3D library: only the points are wanted, analog samples
stay on disk, and no count in the file is believed before it is checked against its size.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from usdface.arrays import FloatArray
from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.io.takes.c3d_header import (
    PointLayout,
    analog_count,
    point_layout,
    read_header,
)
from usdface.io.takes.c3d_ignored import report_beside_points, timecode_of
from usdface.io.takes.c3d_parameters import Parameters, floats, labels_of, text_of, texts_of
from usdface.io.takes.first_frame import frames_before
from usdface.io.takes.raw_take import DEFAULTS, RawTake, finish_take
from usdface.options import TakeOptions
from usdface.takes import MarkerTake

__all__ = ["read_c3d"]

# Parameters that list the labels of points that are no places, as Vicon writes computed quantities.
_COMPUTED = tuple(
    f"POINT:{name}" for name in ("ANGLES", "FORCES", "MOMENTS", "POWERS", "REACTIONS", "SCALARS")
)


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
    header = read_header(path, data)
    parameters = header.parameters
    layout, findings = point_layout(path, data, header)
    findings += report_beside_points(path, parameters, analog_count(header, layout.rate))
    timecode, timecode_findings = timecode_of(path, parameters)
    findings += timecode_findings
    before, renumbered = frames_before(path, layout.first_frame, 1)
    findings += renumbered
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
        unit_name=text_of(parameters, "POINT:UNITS"),
        up_axis=up_axis,
        start_timecode=timecode,
        first_frame=before,
    )
    take, take_findings = finish_take(raw, options)
    return take, findings + axis_findings + take_findings


def _points(data: NDArray[np.uint8], layout: PointLayout) -> FloatArray:
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
    screen = text_of(parameters, "POINT:Y_SCREEN").upper()
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
    """Return one label for each marker, "" for those without."""
    return tuple((labels_of(parameters, "POINT") + [""] * markers)[:markers])


def _computed(parameters: Parameters, labels: tuple[str, ...]) -> list[str]:
    """Return the labels of points that are no places, but angles, forces and the like."""
    computed = {label for key in _COMPUTED for label in texts_of(parameters, key) if label}
    return [label for label in labels if label in computed]
