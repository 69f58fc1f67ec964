"""One image as code values for display: its window, upright, encoded."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from usdface.errors import InputError
from usdface.io.images.display_encoding import for_display
from usdface.io.images.image_file import (
    TURNS,
    check_size,
    fault_of,
    first_line,
    open_file,
    shown_window,
)

__all__ = ["exposure_of", "open_image", "read_image"]

_LOG = ("Logarithmic", "Printing density")  # SMPTE ST 268-1
# Linear light: its 95th percentile is brought to `_BRIGHT` where it is outside of these limits.
_LIT, _BRIGHT = (0.2, 4.0), 0.8
ReadSubimage = Callable[[int, float], NDArray[np.uint8]]
"""Reads an image of an open file, as `read_image`: its index and the exposure."""


def read_image(path: Path, subimage: int = 0, exposure: float = 1.0) -> NDArray[np.uint8]:
    """Read an image as (H, W, 3) code values for display, upright.

    Eight bits of a display space pass as they are; linear light (floating point, or where the
    header says so) is encoded by the sRGB curve, log film (DPX, Cineon) by its printing density.

    Parameters
    ----------
    path : Path
    subimage : int
        Frame of a GIF.
    exposure : float
        Factor on linear light.

    Raises
    ------
    InputError
        If it cannot be read, or is too large.
    """
    with open_image(path) as read:
        return read(subimage, exposure)


@contextmanager
def open_image(path: Path) -> Iterator[ReadSubimage]:
    """Open a file to read its images by `read_image`, one after the other.

    Each one of a GIF needs those before it: a film of them is read from one open file.
    """
    file = open_file(path)
    try:
        yield partial(_read_subimage, path, file)
    finally:
        file.close()


def _read_subimage(
    path: Path, file: Any, subimage: int = 0, exposure: float = 1.0
) -> NDArray[np.uint8]:
    if subimage and not file.seek_subimage(subimage, 0):
        raise InputError(
            f"{path} has no image {subimage}: {fault_of(file)}; export or copy it again",
            "FILE_CUT_OFF",
        )
    spec = file.spec()
    check_size(path, file)
    kind = _kind(spec)
    count = min(spec.nchannels, 3)
    pixels = file.read_image(subimage, 0, 0, count, kind)
    fault = file.geterror()
    if pixels is None or fault:
        raise InputError(
            f"{path} is not readable: {first_line(fault)}; export or copy the image again",
            "FILE_UNREADABLE",
        )
    transfer = str(spec.getattribute("dpx:Transfer") or "")
    log = transfer in _LOG or file.format_name() == "cineon"
    space = "log" if log else str(spec.getattribute("oiio:ColorSpace") or "")
    turns = TURNS.get(spec.get_int_attribute("Orientation", 1), TURNS[1])
    pixels = _shown(pixels.reshape(spec.height, spec.width, -1), shown_window(file))
    coded = for_display(pixels, space, exposure)
    if coded.shape[2] < 3:
        coded = np.repeat(coded[..., :1], 3, axis=2)
    return _upright(coded, turns)


def _shown(pixels: NDArray[Any], window: tuple[int, int, int, int]) -> NDArray[Any]:
    """Return the pixels in the display window; those that the file does not have are black."""
    height, width = pixels.shape[:2]
    if window == (0, 0, width, height):
        return pixels
    left, top, across, down = window
    shown = np.zeros((down, across, pixels.shape[2]), pixels.dtype)
    rows = slice(max(top, 0), max(min(top + down, height), 0))
    columns = slice(max(left, 0), max(min(left + across, width), 0))
    part = pixels[rows, columns]
    y, x = max(-top, 0), max(-left, 0)
    shown[y : y + part.shape[0], x : x + part.shape[1]] = part
    return shown


def _kind(spec: Any) -> Any:
    base = spec.format.basetype
    if base in (oiio.UINT8, oiio.UINT16, oiio.HALF):
        return base
    return oiio.HALF if base in (oiio.FLOAT, oiio.DOUBLE) else oiio.UINT16


def exposure_of(path: Path) -> float:
    """Return the factor that brings linear light to a display; 1 where it is light enough.

    Raises
    ------
    InputError
        If the image cannot be read.
    """
    file = open_file(path)
    try:
        spec = file.spec()
        if spec.format.basetype not in (oiio.HALF, oiio.FLOAT, oiio.DOUBLE):
            return 1.0
        check_size(path, file)
        pixels = file.read_image(0, 0, 0, min(spec.nchannels, 3), oiio.FLOAT)
        if pixels is None:
            raise InputError(
                f"{path} is not readable: {fault_of(file)}; export or copy the image again",
                "FILE_UNREADABLE",
            )
    finally:
        file.close()
    values = np.nan_to_num(np.asarray(pixels)[::4, ::4], posinf=0.0, neginf=0.0)
    bright = float(np.percentile(values, 95.0))
    return 1.0 if bright <= 0 or _LIT[0] <= bright <= _LIT[1] else _BRIGHT / bright


def _upright(pixels: NDArray[np.uint8], turns: tuple[bool, bool, bool]) -> NDArray[np.uint8]:
    exchanged, columns, rows = turns
    if exchanged:
        pixels = pixels.transpose(1, 0, 2)
    if columns:
        pixels = pixels[:, ::-1]
    if rows:
        pixels = pixels[::-1]
    return np.ascontiguousarray(pixels)
