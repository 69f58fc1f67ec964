"""2D tracks of other programs as takes: one convention for all.

Inside usdface a place in an image is in pixels from the outer corner of the top left pixel, whose
centre is (0.5, 0.5); x runs right, and y, which runs down in a `RawTake`, is negated in a
`MarkerTake`. Pixels are square: where a file says that those of the image are not, x is stretched.
A track is seen in the frames that it has samples of; in all others it is occluded.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np

from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.io.takes.raw_take import RawTake, check_size, finish_take
from usdface.io.takes.repeated_samples import first_repeat
from usdface.io.takes.track_text import TrackTable
from usdface.options import TakeOptions
from usdface.takes import MarkerTake

__all__ = [
    "ImageTracks",
    "finish_tracks",
    "image_size",
    "needed_image_size",
    "normalised",
]

_LARGEST_SIDE = 1 << 20  # pixels of an image
_FRAMES = (-(1 << 31) + 1, (1 << 31) - 1)  # of footage, as USD's int holds them
_FARTHEST = 10.0  # images from the origin


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class ImageTracks:
    """Samples of tracks in pixels.

    Attributes
    ----------
    path : Path
    table : TrackTable
        Of the samples; but for their frame numbers, its numbers do not count.
    places : (N, 2) float64 [px]
        From an outer corner of the image, x right; NaN = occluded.
    origin : {"top", "bottom"}
        The left corner that they are counted from; y runs away from it.
    first_frame : int
        Number that the program usually gives the first image.
    image_size : (int, int) or None
        None = unknown.
    focal_length : float [px]
        0 = the file does not say.
    seconds : (N,) float64 [s], optional
        Time of each, if the file has times.
    rate : float [Hz]
        0 = the file does not say.
    confidence : (N,) float64 [1], optional
        The program's confidence in each sample, 0 to 1.
    threshold : float [1]
        Samples with less confidence are occluded, unless the options name another.
    blink : (N,) float64 [1], optional
        How far the eyes blink in the frame of each sample, as the program saw it; NaN = unknown.
    gaze : (N, 2) float64 [rad], optional
        Yaw, to the head's own left, and pitch, up, of the eyes in their head, likewise.
    ignored : sequence of str
        Other data of samples in the file.
    """

    path: Path
    table: TrackTable
    places: FloatArray
    origin: Literal["top", "bottom"]
    first_frame: int
    image_size: tuple[int, int] | None = None
    focal_length: float = 0.0
    seconds: FloatArray | None = None
    rate: float = 0.0
    confidence: FloatArray | None = None
    threshold: float = 0.0
    blink: FloatArray | None = None
    gaze: FloatArray | None = None
    ignored: Sequence[str] = ()


def finish_tracks(tracks: ImageTracks, options: TakeOptions) -> tuple[MarkerTake, list[Finding]]:
    """Return the take and findings.

    Raises
    ------
    InputError
        If there is no sample, a frame number is missing, or a track has two samples in a frame.
    """
    path, table = tracks.path, tracks.table
    if not len(table.frames):
        raise InputError(f"{path}: no track has a sample; expected at least one", "TAKE_EMPTY")
    if not np.isfinite(table.frames).all():
        at = int(np.argmin(np.isfinite(table.frames)))
        raise InputError(
            f"{_place(tracks, at)}: there is no frame number; "
            "fill in the number, or delete the row",
            "ROW_WRONG",
        )
    frames, row = np.unique(table.frames, return_inverse=True)
    check_size(path, len(frames), len(table.labels))
    _refuse_repeats(tracks, row * len(table.labels) + table.tracks)
    places, findings = _trusted_places(tracks, options)
    if tracks.origin == "bottom":
        height = tracks.image_size[1] if tracks.image_size else 0
        places = np.array([0.0, height]) + np.array([1.0, -1.0]) * places
        if not tracks.image_size:
            findings.append(finding("IMAGE_SIZE_UNKNOWN", str(path)))
    positions = np.full((len(frames), len(table.labels), 2), np.nan)
    positions[row, table.tracks] = places
    if frames[0] != tracks.first_frame:
        message = "time 0 is frame {frame_number:g} of the footage"
        findings.append(finding("FRAMES_RENUMBERED", str(path), message, frames[0]))
    seconds = _times_of_frames(tracks, row, len(frames))
    ignored = list(tracks.ignored)
    if tracks.seconds is not None and seconds is None:
        ignored.append("times, which do not increase")
    if ignored:
        message = "not read: {channels}"
        findings.append(finding("CHANNEL_IGNORED", str(path), message, ignored))
    raw = RawTake(
        path=path,
        labels=table.labels,
        positions=positions,
        seconds=seconds,
        frames=frames,
        rate=tracks.rate,
        first_frame=round(float(np.clip(frames[0] - tracks.first_frame, *_FRAMES))),
    )
    of_image = replace(
        options,
        image_size=tracks.image_size,
        focal_length=options.focal_length or tracks.focal_length,
    )
    take, found = finish_take(raw, of_image)
    unseen = np.isnan(positions).all(axis=(1, 2))  # no face was seen, or none is trusted
    if tracks.blink is not None:
        take = replace(take, blink=_of_frames(tracks.blink, row, unseen))
    if tracks.gaze is not None:
        take = replace(take, gaze=_of_frames(tracks.gaze, row, unseen))
    return take, findings + found


def _of_frames(samples: FloatArray, row: IntArray, unseen: BoolArray) -> FloatArray:
    """Return samples (N, ...) of the frames `row` (N,) for all frames, NaN if unseen: (F, ...)."""
    values = np.empty((len(unseen), *samples.shape[1:]))
    values[row] = samples
    values[unseen] = np.nan
    return values


def image_size(
    path: Path, options: TakeOptions, width: float = 0.0, height: float = 0.0, aspect: float = 1.0
) -> tuple[int, int] | None:
    """Return the size of the image [px]: that of the options, else of the file, else None.

    Its width is in square pixels, where the `aspect` of those in the image is another.

    Raises
    ------
    InputError
        If no image has that size.
    """
    if options.image_size:
        width, height = options.image_size
    elif not (width or height):
        return None
    width *= aspect
    if not (1 <= width <= _LARGEST_SIDE and 1 <= height <= _LARGEST_SIDE):
        raise InputError(
            f"{path}: an image of {width:g} x {height:g} pixels; expected 1 to {_LARGEST_SIDE}",
            "VALUES_WRONG",
        )
    return round(width), round(height)


def needed_image_size(
    path: Path, options: TakeOptions, unit: str, width: float = 0.0, height: float = 0.0
) -> tuple[int, int]:
    """Return the size of the image [px] for coordinates that are not in pixels.

    Raises
    ------
    InputError
        If neither options nor file name it.
    """
    size = image_size(path, options, width, height)
    if size is None:
        raise InputError(
            f"{path}: coordinates are {unit}, and the file does not say how large the image is; "
            "give --image-size WIDTH HEIGHT",
            "SETTING_WRONG",
        )
    return size


def normalised(path: Path, places: FloatArray, program: str) -> FloatArray:
    """Return coordinates (N, 2) in parts of the image, NaN = occluded; refuse pixels.

    Raises
    ------
    InputError
        If they lie far outside the image.
    """
    finite = np.where(np.isfinite(places), places, np.nan)
    farthest = float(np.fmax.reduce(np.abs(finite), axis=None, initial=0.0))
    if farthest > _FARTHEST:
        raise InputError(
            f"{path}: coordinates reach {farthest:g}; expected parts of the image as {program} "
            "writes them, not pixels",
            "VALUES_WRONG",
        )
    return np.asarray(finite)


def _trusted_places(tracks: ImageTracks, options: TakeOptions) -> tuple[FloatArray, list[Finding]]:
    """Hide the samples with a confidence below the threshold."""
    if tracks.confidence is None:
        return tracks.places, []
    threshold = tracks.threshold if options.confidence is None else options.confidence
    doubtful = ~(tracks.confidence >= threshold)
    count = int((doubtful & np.isfinite(tracks.places).all(axis=1)).sum())
    places = np.where(doubtful[:, None], np.nan, tracks.places)
    if not count:
        return places, []
    message = "{sample_count} samples with a confidence below {threshold:g} are taken as occluded"
    if not threshold:  # a program's word for failure is no number that a person could set
        message = "{sample_count} samples that the program calls lost are taken as occluded"
        lost = finding("CONFIDENCE_LOW", str(tracks.path), message, count, threshold=threshold)
        return places, [lost]
    return places, [finding("CONFIDENCE_LOW", str(tracks.path), message, count, threshold)]


def _times_of_frames(tracks: ImageTracks, row: IntArray, count: int) -> FloatArray | None:
    """Return the time of each frame (F,) [s]; None unless they increase."""
    if tracks.seconds is None:
        return None
    seconds = np.empty(count)
    seconds[row] = tracks.seconds
    usable = np.isfinite(seconds).all() and (np.diff(seconds) > 0).all()
    return seconds if usable else None


def _refuse_repeats(tracks: ImageTracks, cells: IntArray) -> None:
    at = first_repeat(cells)
    if at is not None:
        label = tracks.table.labels[int(tracks.table.tracks[at])]
        raise InputError(
            f"{_place(tracks, at)}: track {label[:40]!r} has a second sample in frame "
            f"{tracks.table.frames[at]:g}; delete one of them",
            "ROW_WRONG",
        )


def _place(tracks: ImageTracks, at: int) -> str:
    lines = tracks.table.lines
    return f"{tracks.path}, line {lines[at]}" if lines else str(tracks.path)
