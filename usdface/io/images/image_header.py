"""The header of an image: size, rate, time code, focal length."""

import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from usdface.io.images.image_file import TURNS, check_size, open_file, shown_window

__all__ = ["ImageHeader", "read_header"]

_RATES = (
    "FramesPerSecond",
    "dpx:FrameRate",
    "dpx:TVFrameRate",
    "framesPerSecond",
    "oiio:FrameRate",
)
_FULL_FRAME = 36.0  # mm, width of the film that 35 mm equivalents refer to


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


def read_header(path: Path) -> ImageHeader:
    """Read size, rate, time code and focal length of an image.

    Raises
    ------
    InputError
        If it is no image, or too large.
    """
    file = open_file(path)
    try:
        spec = file.spec()
        check_size(path, file)
        width, height = shown_window(file)[2:]
        count = 1
        if spec.get_int_attribute("oiio:subimages", 0) > 1:
            count = spec.get_int_attribute("oiio:subimages", 0)
        elif path.suffix.lower() in (".gif", ".webp", ".tif", ".tiff"):
            while count < 100_000 and file.seek_subimage(count, 0):
                if (file.spec().width, file.spec().height) != (spec.width, spec.height):
                    break  # a thumbnail or a page of another size
                count += 1
            file.geterror()
        turned = TURNS.get(spec.get_int_attribute("Orientation", 1), TURNS[1])[0]
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
