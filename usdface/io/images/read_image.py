"""One image as code values for display: size limits, orientation, colour space, header."""

import math
import re
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from usdface.errors import InputError

__all__ = ["MOST_PIXELS", "ImageHeader", "exposure_of", "open_image", "read_header", "read_image"]

# Pixels of an image: 8K and the largest phones. Memory for a byte of file: flat colours are packed
# 1000 times, which a film of a face is not.
MOST_PIXELS = 2**26
_HEADROOM, _EXPANSION = 2**26, 200
# Orientation of Exif (CIPA DC-008, 4.6.4): whether the axes are exchanged, columns, rows reversed
# after that.
_TURNS = {
    1: (False, False, False),
    2: (False, True, False),
    3: (False, True, True),
    4: (False, False, True),
    5: (True, False, False),
    6: (True, True, False),
    7: (True, True, True),
    8: (True, False, True),
}
_RATES = (
    "FramesPerSecond",
    "dpx:FrameRate",
    "dpx:TVFrameRate",
    "framesPerSecond",
    "oiio:FrameRate",
)
_LOG = ("Logarithmic", "Printing density")  # SMPTE ST 268-1
# Linear light: its 95th percentile is brought to `_BRIGHT` where it is outside of these limits.
_LIT, _BRIGHT = (0.2, 4.0), 0.8
_FULL_FRAME = 36.0  # mm, width of the film that 35 mm equivalents refer to
_PNG = b"\x89PNG\r\n\x1a\n"
_lock = threading.Lock()

ReadSubimage = Callable[[int, float], NDArray[np.uint8]]
"""Reads an image of an open file, as `read_image`: its index and the exposure."""


@dataclass(frozen=True, slots=True)
class ImageHeader:
    """The header of an image.

    Attributes
    ----------
    size : (int, int)
        Width and height [px], upright.
    subimages : int
        Of a GIF: its frames.
    rate : float [Hz]
        0 = not stated.
    timecode : str
        "" = not stated.
    focal : float [px]
        0 = not stated.
    pixel_aspect : float [1]
        Width of a pixel over its height, upright.
    """

    size: tuple[int, int]
    subimages: int = 1
    rate: float = 0.0
    timecode: str = ""
    focal: float = 0.0
    pixel_aspect: float = 1.0


def _open(path: Path) -> Any:
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
            f"{path} is not readable: {_fault(oiio)}; is it cut off, or in another format?",
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


def _checked(path: Path, file: Any) -> None:
    """Refuse an image before its pixels are allocated."""
    spec = file.spec()
    _, _, across, down = _window(file)
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


def read_header(path: Path) -> ImageHeader:
    """Read size, rate, time code and focal length of an image.

    Raises
    ------
    InputError
        If it is no image, or too large.
    """
    file = _open(path)
    try:
        spec = file.spec()
        _checked(path, file)
        width, height = _window(file)[2:]
        count = 1
        if spec.get_int_attribute("oiio:subimages", 0) > 1:
            count = spec.get_int_attribute("oiio:subimages", 0)
        elif path.suffix.lower() in (".gif", ".webp", ".tif", ".tiff"):
            while count < 100_000 and file.seek_subimage(count, 0):
                if (file.spec().width, file.spec().height) != (spec.width, spec.height):
                    break  # a thumbnail or a page of another size
                count += 1
            file.geterror()
        turned = _TURNS.get(spec.get_int_attribute("Orientation", 1), _TURNS[1])[0]
        size = (height, width) if turned else (width, height)
        aspect = _pixel_aspect(spec)
        aspect = 1.0 / aspect if turned else aspect
        return ImageHeader(size, count, _rate(spec), _timecode(spec), _focal(spec), aspect)
    finally:
        file.close()


def _pixel_aspect(spec: Any) -> float:
    aspect = float(spec.get_float_attribute("PixelAspectRatio", 1.0))
    return aspect if 0.01 < aspect < 100 else 1.0


def _rate(spec: Any) -> float:
    for name in _RATES:
        value = spec.getattribute(name)
        if isinstance(value, tuple) and len(value) == 2 and value[1]:
            value = value[0] / value[1]
        if isinstance(value, int | float) and math.isfinite(value) and 0.1 <= value <= 10_000:
            return float(value)
    delay = spec.getattribute("gif:DelayMS")
    return 1000.0 / delay if isinstance(delay, int | float) and delay > 0 else 0.0


def _timecode(spec: Any) -> str:
    """Return the SMPTE time code as text (SMPTE ST 12-1: binary-coded decimals)."""
    value = spec.getattribute("smpte:TimeCode")
    if isinstance(value, str):
        return value if re.fullmatch(r"\d\d[:;]\d\d[:;]\d\d[:;.]\d\d", value) else ""
    if not (isinstance(value, tuple) and value and isinstance(value[0], int)):
        return ""
    word = value[0] & 0xFFFFFFFF
    if word in (0, 0xFFFFFFFF):
        return ""
    fields = [(word >> shift) & 0xFF for shift in (24, 16, 8, 0)]
    masks = (0x3F, 0x7F, 0x7F, 0x3F)
    parts = [field & mask for field, mask in zip(fields, masks, strict=True)]
    numbers = [10 * (part >> 4) + (part & 15) for part in parts]
    dropping = ";" if fields[3] & 0x40 else ":"
    return f"{numbers[0]:02}:{numbers[1]:02}:{numbers[2]:02}{dropping}{numbers[3]:02}"


def _focal(spec: Any) -> float:
    """Return the focal length [px] from Exif: by that on 35 mm film, or by the sensor's density."""
    side = max(spec.width, spec.height)
    equivalent = float(spec.get_float_attribute("Exif:FocalLengthIn35mmFilm", 0.0))
    if equivalent > 0:
        return float(equivalent / _FULL_FRAME * side)
    length = float(spec.get_float_attribute("Exif:FocalLength", 0.0))
    density = float(spec.get_float_attribute("Exif:FocalPlaneXResolution", 0.0))
    unit = {2: 25.4, 3: 10.0, 4: 1.0}.get(
        spec.get_int_attribute("Exif:FocalPlaneResolutionUnit", 2), 25.4
    )
    return float(length * density / unit if length > 0 and density > 0 else 0.0)


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
    file = _open(path)
    try:
        yield partial(_read_subimage, path, file)
    finally:
        file.close()


def _read_subimage(
    path: Path, file: Any, subimage: int = 0, exposure: float = 1.0
) -> NDArray[np.uint8]:
    if subimage and not file.seek_subimage(subimage, 0):
        raise InputError(
            f"{path} has no image {subimage}: {_fault(file)}; export or copy it again",
            "FILE_CUT_OFF",
        )
    spec = file.spec()
    _checked(path, file)
    kind = _kind(spec)
    count = min(spec.nchannels, 3)
    pixels = file.read_image(subimage, 0, 0, count, kind)
    fault = file.geterror()
    if pixels is None or fault:
        raise InputError(
            f"{path} is not readable: {_first_line(fault)}; export or copy the image again",
            "FILE_UNREADABLE",
        )
    transfer = str(spec.getattribute("dpx:Transfer") or "")
    log = transfer in _LOG or file.format_name() == "cineon"
    space = "log" if log else str(spec.getattribute("oiio:ColorSpace") or "")
    turns = _TURNS.get(spec.get_int_attribute("Orientation", 1), _TURNS[1])
    pixels = _shown(pixels.reshape(spec.height, spec.width, -1), _window(file))
    coded = _for_display(pixels, space, exposure)
    if coded.shape[2] < 3:
        coded = np.repeat(coded[..., :1], 3, axis=2)
    return _upright(coded, turns)


def _window(file: Any) -> tuple[int, int, int, int]:
    """Return the window that is shown: left and top from the first pixel, width, height.

    Of EXR; in other formats a position is that on a page or a canvas, not in the camera's image.
    """
    spec = file.spec()
    if file.format_name() != "openexr":
        return 0, 0, spec.width, spec.height
    return spec.full_x - spec.x, spec.full_y - spec.y, spec.full_width, spec.full_height


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


def _for_display(pixels: NDArray[Any], space: str, exposure: float) -> NDArray[np.uint8]:
    named = space.lower()
    linear = named.startswith(("lin", "scene_linear", "aces", "acescg")) or "linear" in named
    log = "log" in named or "cineon" in named
    floating = pixels.dtype == np.float16
    if pixels.dtype == np.uint8 and not (linear or log):
        return pixels
    encoding = "log" if log else "linear" if linear or (floating and not named) else "display"
    table = _table(pixels.dtype.str, encoding, exposure)
    return np.asarray(table[pixels.view(np.uint16) if floating else pixels])


@lru_cache(maxsize=8)
def _table(dtype: str, encoding: str, exposure: float) -> NDArray[np.uint8]:
    """Return the code value for display of every value of a type."""
    kind = np.dtype(dtype)
    if kind == np.float16:
        values = np.arange(2**16, dtype=np.uint16).view(np.float16).astype(np.float64)
        values = np.nan_to_num(values, nan=0.0, posinf=1e6, neginf=0.0)
    else:
        largest = np.iinfo(kind).max
        values = np.arange(largest + 1) / largest
    if encoding == "log":  # Cineon: 0.002 of density a code value of 10 bits, white at 685
        values = 10 ** ((values * 1023 - 685) * 0.002 / 0.6)
    if encoding != "display":
        values = (exposure * values).clip(0.0, 1.0)
        curve = 1.055 * values ** (1 / 2.4) - 0.055  # IEC 61966-2-1
        values = np.where(values <= 0.0031308, 12.92 * values, curve)
    return np.rint(255.0 * values.clip(0.0, 1.0)).astype(np.uint8)


def exposure_of(path: Path) -> float:
    """Return the factor that brings linear light to a display; 1 where it is light enough.

    Raises
    ------
    InputError
        If the image cannot be read.
    """
    file = _open(path)
    try:
        spec = file.spec()
        if spec.format.basetype not in (oiio.HALF, oiio.FLOAT, oiio.DOUBLE):
            return 1.0
        _checked(path, file)
        pixels = file.read_image(0, 0, 0, min(spec.nchannels, 3), oiio.FLOAT)
        if pixels is None:
            raise InputError(
                f"{path} is not readable: {_fault(file)}; export or copy the image again",
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


def _fault(source: Any) -> str:
    return _first_line(source.geterror())


def _first_line(text: str) -> str:
    return text.strip().splitlines()[0] if text.strip() else "unknown format"
