"""Some images of a film for a page: cut to the face, small, as JPEG."""

from collections.abc import Sequence
from pathlib import Path

from usdface.errors import InputError
from usdface.footage.colour_channel import Pixels
from usdface.footage.detect import Box
from usdface.io.images.encode import encode_image
from usdface.io.images.film import open_film
from usdface.io.page_image import smaller

__all__ = ["read_page_frames"]

# Pixels along the longer side, and the quality: two dozen such images are a megabyte.
_SIDE, _QUALITY = 480, 80


def read_page_frames(
    path: Path, frames: Sequence[int], box: Box, size: tuple[int, int] | None
) -> dict[int, bytes]:
    """Return the part of some images of a film that is in a box, as JPEG, by frame index.

    Frames without an image are left out. `size` is that of the take's images [px], if it is known.

    Raises
    ------
    InputError
        If there is no film, it is shorter, or its images have another size, or are smaller than
        the box.
    """
    film = open_film(path)
    left, top, right, bottom = box
    found = {}
    single = bool(film.files) and film.header.subimages <= 1
    # Frames after the last image: their program counts by the numbers in the files' names.
    beyond = single and max(frames, default=0) >= len(film.files)
    shift = max(film.files[0].number - 1, 0) if beyond else 0
    for frame in frames:
        index = frame - shift
        if index < 0 or (single and index >= len(film.files)):
            raise InputError(
                f"{path} has {len(film.files)} images; the take has a frame {frame}; give the "
                "images that it was made of",
                "FRAMES_OUTSIDE",
            )
        pixels = film.frame(index)
        if pixels is None:
            continue
        height, width = pixels.shape[:2]
        if size is not None and (width, height) != size:
            raise InputError(
                f"{path} has {width} x {height} pixels, the take is of images of {size[0]} x "
                f"{size[1]}; give those that it was made of",
                "VALUES_WRONG",
            )
        if height < bottom or width < right:
            raise InputError(
                f"{path} has {width} x {height} pixels, the take is of larger images; "
                "give those that it was made of",
                "VALUES_WRONG",
            )
        part = pixels[top:bottom, left:right]
        step = max(part.shape) / _SIDE
        found[frame] = _jpeg(smaller(part, step) if step > 1.0 else part)
    return found


def _jpeg(pixels: Pixels) -> bytes:
    return encode_image(pixels, ".jpg", {"Compression": f"jpeg:{_QUALITY}"})
