"""Files of images opened by OpenImageIO, with limits of size."""

import threading
from pathlib import Path
from typing import Any

import OpenImageIO as oiio

from usdface.errors import InputError

__all__ = [
    "MOST_PIXELS",
    "TURNS",
    "check_size",
    "fault_of",
    "first_line",
    "open_file",
    "shown_window",
]

# Pixels of an image: 8K and the largest phones. Memory for a byte of file: flat colours are packed
# 1000 times, which a film of a face is not.
MOST_PIXELS = 2**26
_HEADROOM, _EXPANSION = 2**26, 200
# Orientation of Exif (CIPA DC-008, 4.6.4): whether the axes are exchanged, columns, rows reversed
# after that.
TURNS = {
    1: (False, False, False),
    2: (False, True, False),
    3: (False, True, True),
    4: (False, False, True),
    5: (True, False, False),
    6: (True, True, False),
    7: (True, True, True),
    8: (True, False, True),
}
_PNG = b"\x89PNG\r\n\x1a\n"
_lock = threading.Lock()


def open_file(path: Path) -> Any:
    """Open an image, to be closed by the caller.

    Raises
    ------
    InputError
        If it is no image, or cannot be read.
    """
    _check_png(path)
    with _lock:  # the limit is one of the whole library
        before = oiio.get_int_attribute("limits:imagesize_MB")
        oiio.attribute("limits:imagesize_MB", max(1, 16 * MOST_PIXELS >> 20))
        try:
            file = oiio.ImageInput.open(str(path))
        finally:
            oiio.attribute("limits:imagesize_MB", before)
    if file is None:
        raise InputError(
            f"{path} is not readable: {fault_of(oiio)}; is it cut off, or in another format?",
            "FILE_UNREADABLE",
        )
    return file


def _check_png(path: Path) -> None:
    """Refuse a PNG that does not begin as one: libpng would say so on the terminal, too."""
    try:
        with path.open("rb") as file:
            start = file.read(16)
    except OSError as error:
        raise InputError(f"{path} is not readable: {error}", "FILE_UNREADABLE") from error
    if start.startswith(_PNG) and start[12:] != b"IHDR":
        raise InputError(
            f"{path} is not readable: its PNG header is damaged; export or copy it again",
            "FILE_UNREADABLE",
        )


def check_size(path: Path, file: Any) -> None:
    """Refuse an image before its pixels are allocated."""
    spec = file.spec()
    _, _, across, down = shown_window(file)
    if spec.depth > 1 or spec.deep or spec.width < 1 or spec.height < 1:
        raise InputError(
            f"{path} is no flat image; expected pixels in one plane: export it without depth",
            "FILE_KIND_UNKNOWN",
        )
    count = max(spec.width * spec.height, across * down)
    memory = count * spec.nchannels * max(spec.format.size(), 1)
    most = _HEADROOM + _EXPANSION * path.stat().st_size
    if count > MOST_PIXELS or memory > most:
        raise InputError(
            f"{path} has {max(spec.width, across)} x {max(spec.height, down)} pixels of "
            f"{spec.nchannels} channels in a file of {path.stat().st_size} bytes; "
            f"expected at most {MOST_PIXELS} pixels",
            "TOO_LARGE",
        )


def shown_window(file: Any) -> tuple[int, int, int, int]:
    """Return the window that is shown: left and top from the first pixel, width, height.

    Of EXR; in other formats a position is that on a page or a canvas, not in the camera's image.
    """
    spec = file.spec()
    if file.format_name() != "openexr":
        return 0, 0, spec.width, spec.height
    return spec.full_x - spec.x, spec.full_y - spec.y, spec.full_width, spec.full_height


def fault_of(source: Any) -> str:
    """Return the first line of the error that OpenImageIO keeps for a file or for itself."""
    return first_line(source.geterror())


def first_line(text: str) -> str:
    """Return the first line of an error of OpenImageIO, which is silent about unknown formats."""
    return text.strip().splitlines()[0] if text.strip() else "unknown format"
