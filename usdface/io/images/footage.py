"""Takes from films of a face with painted dots."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from usdface.arrays import BoolArray
from usdface.errors import InputError
from usdface.face.fitted_setup import fit_setup
from usdface.findings import Finding, finding
from usdface.footage.choose_channel import choose_model, colour_at, model_of_colour
from usdface.footage.colour_channel import Pixels, parse_colour
from usdface.footage.detect import DotModel
from usdface.footage.dot_groups import dots_far_apart
from usdface.footage.face_names import BoundVertices
from usdface.footage.fixes import Fix
from usdface.footage.labels import DotName
from usdface.footage.scan import scan
from usdface.footage.track import track_dots
from usdface.footage.tracks import Tracks
from usdface.io.bind_file import read_bind
from usdface.io.images.film import Film, open_film
from usdface.io.images.footage_files import read_fixes, read_named_places
from usdface.io.rigs.files import read_rig_file
from usdface.io.takes.raw_take import RawTake, finish_take
from usdface.io.takes.timing import check_timecode
from usdface.options import TakeOptions
from usdface.setup.assumed_mesh import assumed_mesh_findings
from usdface.takes import MarkerTake

__all__ = ["Footage", "read_footage", "read_image_take"]

# Images that are tried, spread over the film, for the colour of the dots: the first may be a slate.
_TRIED = 8
_MOST_FINDINGS = 20  # of one kind
_SQUARE = 0.005  # off 1, by which a ratio with two decimals may be rounded


@dataclass(frozen=True, eq=False, slots=True)
class Footage:
    """A tracked film: the images, the colour channel and the tracks of the dots."""

    film: Film
    model: DotModel
    tracks: Tracks

    @property
    def summary(self) -> dict[str, Any]:
        """Numbers for the screen."""
        seen = self.tracks.confidence > 0
        return {
            "channel": self.model.channel.name,
            "reference_frame": self.tracks.reference,
            "image_size": list(self.film.header.size),
            "confidence_mean": round(float(self.tracks.confidence[seen].mean()), 3),
        }

    @property
    def details(self) -> dict[str, Any]:
        """Numbers of each marker and frame, for a report; not of markers that are never seen."""
        tracks = self.tracks
        seen: BoolArray = np.asarray((tracks.confidence > 0).any(axis=0))
        return {
            "dots": {
                name: {
                    "confidence": np.round(tracks.confidence[:, k], 2).tolist(),
                    "deviation_px": _rounded(np.nanmean(tracks.deviations[:, k])),
                    "half_axes_px": [
                        _rounded(v) for v in np.nanmean(tracks.ellipses[:, k, :2], axis=0)
                    ],
                }
                for k, name in enumerate(tracks.names)
                if seen[k]
            }
        }


def _rounded(value: Any) -> float:
    return round(float(value), 3)


def read_image_take(path: Path, options: TakeOptions) -> tuple[MarkerTake, list[Finding]]:
    """Read a take from images of a face with painted dots.

    Parameters
    ----------
    path : Path
        ``face.####.png``, ``face.%04d.png``, a folder, one image, a GIF or a movie.
    options : TakeOptions
        Its `dots`, `names` and `fixes` are of images; `rate` overrides that of the headers.

    Raises
    ------
    InputError
        If there are no images, no dots, sizes change, or the rate is not that of the start
        timecode.
    """
    take, _, findings = read_footage(path, options)
    return take, findings


def read_footage(path: Path, options: TakeOptions) -> tuple[MarkerTake, Footage, list[Finding]]:
    """Read a film: the take, the tracks behind it, and findings.

    Raises
    ------
    InputError
        As `read_image_take`.
    """
    face, assumed = _bound_vertices(options)
    named = read_named_places(Path(options.names)) if options.names else ()
    fixes = read_fixes(Path(options.fixes)) if options.fixes else ()
    film = open_film(path)
    if film.length:
        _check_frames(film.length, {str(options.names): named, str(options.fixes): fixes})
    model = _model(film, options.dots)
    frames = list(scan(film.loads(), model))
    if len(film.unreadable) == len(frames):
        raise InputError(next(iter(film.unreadable.values())), "FILE_UNREADABLE")
    try:
        tracks = track_dots(frames, named, fixes, face)
    except InputError as error:
        if error.code != "MARKER_UNKNOWN":  # of a correction
            raise
        raise InputError(f"{options.fixes}: {error}", error.code) from error
    if not tracks.names:
        raise InputError(
            f"{film.path}: no dots are found ({model.channel.name}); name another "
            "colour, or the place of a dot in the first image: --dots",
            "TAKE_EMPTY",
        )
    take, findings = _take(film, tracks, options)
    return (
        take,
        Footage(film, model, tracks),
        [
            *assumed,
            *_found(film, model, tracks, take.start_timecode),
            *_named(film, tracks, face),
            *findings,
        ],
    )


def _check_frames(count: int, rows: Mapping[str, Sequence[DotName] | Sequence[Fix]]) -> None:
    """Refuse, before the images are read, rows of a file whose frame the film does not have."""
    for file, own in rows.items():
        outside = next((row for row in own if not 0 <= row.frame < count), None)
        if outside is not None:
            raise InputError(
                f"{file}: {outside.name!r} is in frame {outside.frame}; the film has the frames 0 "
                f"to {count - 1}, counted from 0",
                "FRAMES_OUTSIDE",
            )


def _bound_vertices(options: TakeOptions) -> tuple[BoundVertices | None, list[Finding]]:
    """Read the vertices of a binding; None without one."""
    if options.bind is None and options.rig is None:
        return None, []
    if options.bind is None or options.rig is None:
        raise InputError(
            "dots are named by a binding file and the rig that it is of; give both (--bind, --rig)",
            "SETTING_WRONG",
        )
    given, _ = read_bind(Path(options.bind))
    character, _ = read_rig_file(Path(options.rig))
    mesh = character.mesh(given.binding.mesh)
    setup, _ = fit_setup(given, mesh)
    neutral = None if setup.neutral_assumed else setup.neutral
    face = BoundVertices(setup.binding.markers, mesh.points[setup.binding.points], neutral)
    return face, assumed_mesh_findings(character, given.binding, str(options.bind))


def _named(film: Film, tracks: Tracks, face: BoundVertices | None) -> list[Finding]:
    if face is None:
        return []
    own = [name for name in tracks.names if name in face.names]
    message = "{marker_count} of the {bound_count} markers of the binding"
    return [finding("DOTS_NAMED", str(film.path), message, len(own), len(face.names))]


def _model(film: Film, dots: str | None) -> DotModel:
    """Choose the channel, by the first image that shows dots."""
    fault: InputError | None = None
    for pixels in film.samples(_TRIED):
        try:
            return _model_of(pixels, dots)
        except InputError as error:
            fault = fault or error
            if error.code != "MARKERS_TOO_FEW":
                break
    if fault is None:
        fault = InputError(next(iter(film.unreadable.values()), "no image"), "FILE_UNREADABLE")
    raise InputError(f"{film.path}: {fault}", fault.code) from fault


def _model_of(pixels: Pixels, dots: str | None) -> DotModel:
    if not dots or dots == "auto":
        return choose_model(pixels)
    parts = dots.split(",")
    if len(parts) == 2:
        try:
            place = float(parts[0]), float(parts[1])
        except ValueError:
            place = None
        if place is not None:
            return model_of_colour(pixels, *colour_at(pixels, place))
    return model_of_colour(pixels, parse_colour(dots), None)


def _take(film: Film, tracks: Tracks, options: TakeOptions) -> tuple[MarkerTake, list[Finding]]:
    raw = RawTake(
        path=film.path,
        labels=tracks.names,
        positions=np.array(tracks.places),
        diameters=np.full(len(tracks.names), tracks.diameter),
        deviation=tracks.deviation,
        seconds=np.array(film.times) if film.times else None,
        rate=film.header.rate,
        start_timecode=options.start_timecode or film.timecode,
    )
    focal = options.focal_length or film.header.focal or None
    given = replace(options, image_size=film.header.size, focal_length=focal)
    take, findings = finish_take(raw, given)
    check_timecode(film.path, options.start_timecode or "", take.rate)
    return take, findings


def _found(film: Film, model: DotModel, tracks: Tracks, timecode: str) -> list[Finding]:
    where = str(film.path)
    message = "{dot_count} dots, by the channel {channel}"
    found = [finding("DOTS_FOUND", where, message, len(tracks.names), model.channel.name)]
    if film.header.subimages > 1:
        message = "the {image_count} images in this one file are taken as a film"
        found.append(finding("DOTS_FOUND", where, message, film.header.subimages))
    if film.ignored_parts:
        message = "{part_count} parts (layers, views) beside the first of an image are ignored"
        found.append(
            finding("FEATURE_DROPPED", where, message, film.ignored_parts, feature="image_parts")
        )
    if abs(film.header.pixel_aspect - 1.0) > _SQUARE:
        message = "the pixels of the images are {ratio:g} times as wide as high"
        found.append(finding("PIXELS_NOT_SQUARE", where, message, film.header.pixel_aspect))
    if film.header.timecode and not timecode:
        message = "the time code of the first image, which cannot be read"
        found.append(finding("FEATURE_DROPPED", where, message, feature="start_timecode"))
    if film.missing:
        message = "images are missing; all markers are occluded in frames {frames}"
        found.append(finding("FRAMES_DROPPED", where, message, film.missing))
    for index in sorted(film.unreadable)[:_MOST_FINDINGS]:
        message = "{error}; all markers are occluded in frame {frame}"
        reason = InputError(film.unreadable[index], "FILE_UNREADABLE")
        found.append(finding("IMAGE_UNREADABLE", where, message, reason, index))
    if tracks.cuts:
        message = "at frames {frames}"
        found.append(finding("FOOTAGE_CUT", where, message, list(tracks.cuts)))
    found += _apart(where, tracks)
    if tracks.left_out:
        message = "{track_count} short-lived detections are left out"
        found.append(finding("DOTS_IGNORED", where, message, tracks.left_out))
    if tracks.unmatched:
        message = "no dot is near: {markers}"
        found.append(finding("DOT_UNMATCHED", where, message, list(tracks.unmatched)))
    for doubt in tracks.doubts[:_MOST_FINDINGS]:
        message = "frames {first_frame} to {last_frame} may be of another dot"
        place = f"{where}: {tracks.names[doubt.track]}"
        found.append(finding("TRACK_DOUBTED", place, message, doubt.first, doubt.last))
    if len(tracks.doubts) > _MOST_FINDINGS:
        message = "{more_count} more such stretches of frames, of {markers}"
        names = list(dict.fromkeys(tracks.names[d.track] for d in tracks.doubts[_MOST_FINDINGS:]))
        count = len(tracks.doubts) - _MOST_FINDINGS
        found.append(finding("TRACK_DOUBTED", where, message, count, names))
    if len(film.unreadable) > _MOST_FINDINGS:
        message = "{more_count} more images; all markers are occluded there"
        count = len(film.unreadable) - _MOST_FINDINGS
        found.append(finding("IMAGE_UNREADABLE", where, message, count))
    return found


def _apart(where: str, tracks: Tracks) -> list[Finding]:
    """Report dots that lie far from the others in the reference frame, as those of another face."""
    groups = dots_far_apart(tracks.places[tracks.reference])
    if groups is None:
        return []
    larger, smaller, gap = groups
    message = (
        "{dot_count} dots and {other_count} others ({markers}) lie {gap_px:.0f} px apart: if they "
        "are of two faces, crop the images to one"
    )
    names = [tracks.names[k] for k in smaller.tolist()]
    counts = len(larger), len(smaller)
    return [finding("DOTS_APART", where, message, *counts, names, gap)]
