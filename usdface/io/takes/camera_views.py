"""Takes of several calibrated cameras that filmed one performance, as one take in space."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from usdface.arrays import FloatArray, IntArray
from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.geometry.camera import Camera, undistort
from usdface.geometry.multi_view import PointsOfViews, epipolar_distances, triangulate
from usdface.io.takes.camera_calibration import read_calibration
from usdface.io.takes.files import read_take
from usdface.io.takes.formats import TAKE_READERS
from usdface.io.takes.raw_take import RawTake, finish_take
from usdface.io.takes.timing import check_timecode
from usdface.numerics.rms import rms
from usdface.options import TakeOptions
from usdface.takes import MarkerTake

__all__ = ["read_views"]

_USD = frozenset({".usd", ".usda", ".usdc"})  # they need no options, and follow none
_MOST_POSITIONS = 1 << 26  # in all cameras
# A pixel farther from the projection of its point than this, in medians of its camera and in
# pixels, is another marker's: of normal errors one in 10^10 is 10 medians away.
_FAR_MEDIANS, _FAR_PIXELS = 10.0, 1.0
# RMS [px] above which the cameras as a whole disagree; set by hand: calibrations and tracks of dots
# are good to a pixel.
_DOUBTFUL = 3.0
_LAST_FRAME = 10**9
# Frames that cameras are tried to be out of step by, and frames that are compared.
_MOST_STEPS, _COMPARED = 120, 500
# OpenCV's space, y down and z ahead, to that of a camera with y up.
_Y_UP = np.array([1.0, -1.0, -1.0])


@dataclass(frozen=True, eq=False, slots=True)
class _Views:
    """Markers that two cameras know, in the pixels of each camera's calibration."""

    names: tuple[str, ...]
    frames: IntArray  # (F,) of the footage, from 0
    pixels: FloatArray  # (C, F, M, 2)
    rate: float
    blink: FloatArray | None  # (F,) mean of the cameras that saw it, NaN where none did
    timecodes: tuple[str, ...]  # different ones of the takes that begin with the first frame


def read_views(
    paths: Sequence[Path], calibration: Path, options: TakeOptions, sync: Sequence[int] = ()
) -> tuple[MarkerTake, list[Finding]]:
    """Read a 2D take of each camera, and find where in space the markers were.

    Frames belong together by their number in the footage, markers by their names. A marker that
    fewer than two cameras see in a frame is occluded there.

    Parameters
    ----------
    paths : sequence of Path
        A 2D take of each camera, in the order of the calibration.
    calibration : Path
    options : TakeOptions
        Unit and up axis of the calibration's world; the others hold for the takes.
    sync : sequence of int
        A frame of each camera's footage, all of one moment; empty = footages begin together.

    Raises
    ------
    InputError
        If a file cannot be used, a take is not 2D, they do not fit the calibration or each other,
        or no marker is seen by two cameras at once.
    """
    cameras = read_calibration(calibration)
    if len(cameras) != len(paths):
        raise InputError(
            f"{calibration}: {len(cameras)} cameras for {len(paths)} takes; give one of each, "
            "in the calibration's order",
            "SETTING_WRONG",
        )
    if sync and (len(sync) != len(paths) or max(map(abs, sync)) > _LAST_FRAME):
        raise InputError(
            f"frames of one moment are {list(sync)[:10]} for {len(paths)} takes; give one of each, "
            f"up to {_LAST_FRAME}",
            "SETTING_WRONG",
        )
    takes, findings = [], []
    for path, camera in zip(paths, cameras, strict=True):
        take, found = _take_of_camera(path, camera, options)
        takes.append(take)
        findings += [each for each in found if each.code != "RATE_ASSUMED" or not takes[1:]]
    views = _joined(paths, takes, cameras, sync or [0] * len(paths))
    count = len(views.frames), len(views.names)
    solved = triangulate(cameras, views.pixels.reshape(len(cameras), -1, 2))
    agreement, points = _trusted_points(paths, solved, views)
    if any(each.code == "VIEWS_DISAGREE" for each in agreement):
        agreement += _steps_that_fit(paths, cameras, views)
    # The first camera is the world of a stereo pair; it is taken to stand upright.
    first = cameras[0]
    upright = np.allclose(first.rotation, np.eye(3)) and not first.translation.any()
    positions = points.reshape(*count, 3)
    raw = RawTake(
        path=paths[0],
        labels=views.names,
        positions=positions * _Y_UP if upright else positions,
        frames=views.frames.astype(np.float64),
        rate=views.rate,
        up_axis="Y" if upright else None,
        start_timecode=options.start_timecode or next(iter(views.timecodes), ""),
        first_frame=int(views.frames[0]),
    )
    check_timecode(paths[0], options.start_timecode or "", views.rate)
    if not options.start_timecode:
        of_first = views.timecodes[:1] if sync else views.timecodes
        findings += _timecodes_dropped(paths[0], takes, of_first)
    given = TakeOptions(units=options.units, up_axis=options.up_axis)
    take, found = finish_take(raw, given)
    return replace(take, blink=views.blink), findings + agreement + found


def _timecodes_dropped(
    path: Path, takes: Sequence[MarkerTake], first: Sequence[str]
) -> list[Finding]:
    """Report timecodes that are not that of the take; `first` are those of its first frame."""
    message = "the start timecode of a take that begins in another frame: {timecode}"
    others = [take.start_timecode for take in takes if take.start_timecode]
    if first:
        message = "another start timecode of the same frame: {timecode}; are they in step? (--sync)"
        others = list(first[1:])
    where, feature = str(path), "start_timecode"
    return [finding("FEATURE_DROPPED", where, message, t, feature=feature) for t in others[:1]]


def _take_of_camera(
    path: Path, camera: Camera, options: TakeOptions
) -> tuple[MarkerTake, list[Finding]]:
    """Read a take; its occlusions count only where no two cameras see a marker."""
    given = replace(options, units=None, up_axis=None)
    if given.image_size is None and "image_size" in TAKE_READERS.find(path)[0].format.options:
        given = replace(given, image_size=camera.image_size)
    take, findings = read_take(path, TakeOptions() if path.suffix.lower() in _USD else given)
    if not isinstance(take, MarkerTake) or take.dimension != 2:
        raise InputError(
            f"{path} is no 2D take; expected tracks in the images of one camera", "TAKE_KIND_WRONG"
        )
    if take.gaze is not None:
        findings.append(
            finding("CHANNEL_IGNORED", str(path), "gaze is not read of several cameras")
        )
        take = replace(take, gaze=None)
    if take.image_size is None:
        raise InputError(
            f"{path}: neither the take nor the calibration says how large the image is; "
            "give --image-size WIDTH HEIGHT",
            "SETTING_WRONG",
        )
    return take, [found for found in findings if found.code != "MARKER_OCCLUDED"]


def _joined(
    paths: Sequence[Path],
    takes: Sequence[MarkerTake],
    cameras: Sequence[Camera],
    sync: Sequence[int],
) -> _Views:
    rates = [take.rate for take in takes]
    if max(rates) - min(rates) > 1e-4 * max(rates):
        other = int(np.argmax(np.abs(np.array(rates) - rates[0])))
        raise InputError(
            f"{paths[0]} and {paths[other]} have {rates[0]:g} and {rates[other]:g} frames a "
            "second; give --rate if that is wrong",
            "TIMES_WRONG",
        )
    rate = rates[0] or 1.0
    # All frames are counted as in the footage of the first camera.
    numbers = [
        np.round(take.times * rate).astype(np.int64) + take.first_frame + sync[0] - step
        for take, step in zip(takes, sync, strict=True)
    ]
    every = np.unique(np.concatenate(numbers))
    cameras_of = {name: sum(name in t.names for t in takes) for t in takes for name in t.names}
    names = tuple(name for name, count in cameras_of.items() if count > 1)
    if not names:
        raise InputError(
            f"{paths[0]}: no marker of it is in another camera's take; markers belong together by "
            "their names",
            "MARKER_UNKNOWN",
        )
    if len(takes) * len(every) * len(names) > _MOST_POSITIONS:
        raise InputError(
            f"{paths[0]}: {len(every)} frames are too many; "
            "cut the takes to the part that is needed",
            "TOO_LARGE",
        )
    pixels = np.full((len(takes), len(every), len(names), 2), np.nan)
    for view, take, camera, frames in zip(pixels, takes, cameras, numbers, strict=True):
        known = [n for n, name in enumerate(names) if name in take.names]
        place = take.select(tuple(names[n] for n in known)) * [1.0, -1.0]
        view[np.searchsorted(every, frames)[:, None], known] = _calibrated(take, camera, place)
    seen = np.isfinite(pixels[..., 0]).any(axis=(0, 2))
    blink = _mean_blink(takes, [np.searchsorted(every, frames) for frames in numbers], len(every))
    blink = None if blink is None else blink[seen]
    shown = every[seen]
    starts = [
        t.start_timecode for t, own in zip(takes, numbers, strict=True) if own[0] in shown[:1]
    ]
    timecodes = tuple(dict.fromkeys(filter(None, starts)))
    return _Views(names, shown, pixels[:, seen], takes[0].rate, blink, timecodes)


def _mean_blink(
    takes: Sequence[MarkerTake], rows: Sequence[IntArray], count: int
) -> FloatArray | None:
    """Return the takes' measures of a blink in `count` frames, of which they have `rows`."""
    sums, seen = np.zeros((2, count))
    for take, own in zip(takes, rows, strict=True):
        if take.blink is not None:
            sums[own] += np.nan_to_num(take.blink)
            seen[own] += np.isfinite(take.blink)
    if not seen.any():
        return None
    return np.asarray(np.divide(sums, seen, out=np.full(count, np.nan), where=seen > 0))


def _steps_that_fit(
    paths: Sequence[Path], cameras: Sequence[Camera], views: _Views
) -> list[Finding]:
    """Return findings on cameras that agree better some frames earlier or later."""
    findings = []
    first, *others = (undistort(c, p) for c, p in zip(cameras, views.pixels, strict=True))
    for path, camera, other in zip(paths[1:], cameras[1:], others, strict=True):
        medians = {}
        for step in range(-_MOST_STEPS, _MOST_STEPS + 1):
            before, after = max(0, -step), max(0, step)
            count = min(len(first) - before - after, _COMPARED)
            if count < 1:
                continue
            shown, moved = first[before : before + count], other[after : after + count]
            away = epipolar_distances(cameras[0], camera, shown, moved)
            if np.isfinite(away).any():
                medians[step] = float(np.nanmedian(away))
        best = min(medians, key=lambda step: (medians[step], abs(step)), default=0)
        if best and medians[best] < medians.get(0, np.inf) / 2:
            message = "fits better with --sync of {step_count} frames more than the first camera's"
            findings.append(finding("VIEWS_OUT_OF_STEP", str(path), message, best))
    return findings


def _calibrated(take: MarkerTake, camera: Camera, places: FloatArray) -> FloatArray:
    """Return places from the corner of the take's image as pixels of the calibration's."""
    shown, expected = take.image_size, camera.image_size
    scale = 1.0
    if shown and expected and shown != expected:
        scale = expected[0] / shown[0]
        if abs(shown[1] * scale - expected[1]) > 1:
            raise InputError(
                f"{take.source}: an image of {shown[0]} x {shown[1]} pixels, but {camera.name!r} "
                f"was calibrated on {expected[0]} x {expected[1]}",
                "SETTING_WRONG",
            )
    return np.asarray(places * scale - 0.5)


def _trusted_points(
    paths: Sequence[Path], solved: PointsOfViews, views: _Views
) -> tuple[list[Finding], FloatArray]:
    """Return findings on how well the cameras agree, and the points on which they do."""
    if not np.isfinite(solved.residuals).any():
        raise InputError(
            f"{paths[0]}: no marker is seen by two cameras at once, with rays that cross in front "
            "of them; do the takes' frames, names and order fit the calibration?",
            "TAKE_EMPTY",
        )
    findings = []
    far = np.zeros(len(solved.points), dtype=bool)
    for path, residuals in zip(paths, solved.residuals, strict=True):
        found = residuals[np.isfinite(residuals)]
        if not len(found):
            continue
        limit = max(_FAR_PIXELS, _FAR_MEDIANS * float(np.median(found)))
        far |= np.nan_to_num(residuals) > limit
        message = "markers lie {rms_px:.2f} px RMS from the projections of their points"
        apart = rms(found[found <= limit])
        findings.append(finding("REPROJECTION_ERROR", str(path), message, apart))
        if apart > _DOUBTFUL:
            message = "by {rms_px:.1f} px RMS: do calibration, names and frame numbers fit?"
            findings.append(finding("VIEWS_DISAGREE", str(path), message, apart))
    points = np.where(far[:, None], np.nan, solved.points)
    if far.any():
        marker = np.flatnonzero(far) % len(views.names)
        worst = sorted({views.names[n] for n in marker})
        message = "{place_count} places on which cameras disagree are taken as occluded: {markers}"
        findings.append(finding("VIEWS_DISAGREE", str(paths[0]), message, int(far.sum()), worst))
    once = np.isfinite(views.pixels[..., 0]).sum(axis=0) == 1
    if once.any():
        message = "{place_count} places that one camera alone sees are taken as occluded"
        findings.append(finding("VIEW_SINGLE", str(paths[0]), message, int(once.sum())))
    return findings, points
