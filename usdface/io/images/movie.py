"""Movies, by PyAV where it is installed (the extra `movies`): frames with their own times."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from usdface.errors import InputError
from usdface.footage.colour_channel import Pixels
from usdface.io.images.image_file import MOST_PIXELS
from usdface.io.images.image_header import ImageHeader

__all__ = ["movie_frames", "read_movie_header"]


def read_movie_header(path: Path) -> ImageHeader:
    """Read size and rate of a movie.

    Raises
    ------
    InputError
        If it is none, or too large.
    """
    for _, pixels in movie_frames(path, None):
        with _open(path) as file:
            stream = file.streams.video[0]
            rate = float(stream.average_rate or 0)
            timecode = str(stream.metadata.get("timecode") or file.metadata.get("timecode") or "")
        return ImageHeader((pixels.shape[1], pixels.shape[0]), 1, rate, timecode)
    raise InputError(f"{path} has no images; is it cut off? Copy it again", "TAKE_EMPTY")


def _open(path: Path) -> Any:
    import av

    try:
        file = av.open(str(path))
    except (av.FFmpegError, ValueError, OSError) as error:
        raise InputError(
            f"{path} is not readable: {error}; is it cut off, or of a codec that FFmpeg lacks?",
            "FILE_UNREADABLE",
        ) from error
    if not file.streams.video:
        file.close()
        raise InputError(
            f"{path} has no video; expected a movie, or numbered images", "FILE_KIND_UNKNOWN"
        )
    size = file.streams.video[0].codec_context
    if size.width * size.height > MOST_PIXELS:
        file.close()
        raise InputError(
            f"{path} has {size.width} x {size.height} pixels; "
            f"expected at most {MOST_PIXELS}: scale it down",
            "TOO_LARGE",
        )
    return file


def movie_frames(path: Path, size: tuple[int, int] | None) -> Iterator[tuple[float, Pixels]]:
    """Yield the time [s] and pixels (H, W, 3) of each frame, upright.

    Times are the presentation times: phones record at changing rates.

    Raises
    ------
    InputError
        If it cannot be read, or its size changes.
    """
    import av

    with _open(path) as file:
        last = -1.0
        try:
            for frame in file.decode(file.streams.video[0]):
                pixels = frame.to_ndarray(format="rgb24")
                pixels = np.rot90(pixels, round(getattr(frame, "rotation", 0) / 90) % 4)
                if size is not None and (pixels.shape[1], pixels.shape[0]) != size:
                    raise InputError(
                        f"{path}: the size of the images changes; "
                        "give the parts as separate movies",
                        "VALUES_WRONG",
                    )
                time = float(frame.time) if frame.time is not None else last + 1.0 / 30.0
                if time > last:
                    last = time
                    yield time, np.ascontiguousarray(pixels)
        except av.FFmpegError as error:
            raise InputError(
                f"{path} is not readable: {error}; is it cut off? Copy it again", "FILE_CUT_OFF"
            ) from error
