"""Images as glTF holds them: PNG or JPEG, eight bits, sRGB for colours and linear for data."""

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.rigs import Texture

__all__ = ["has_alpha", "image_type", "to_gltf_image"]

_PNG, _JPEG = b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff"
_MAX_BYTES = 2**30
_MAX_PIXELS = 2**26  # 8192 x 8192; as floats with four channels this is 1 GiB


def image_type(data: bytes) -> str:
    """Return the MIME type of PNG or JPEG data by their first bytes, "" for anything else."""
    if data.startswith(_PNG):
        return "image/png"
    return "image/jpeg" if data.startswith(_JPEG) else ""


def has_alpha(data: bytes) -> bool:
    """Return whether PNG or JPEG data have an alpha channel (by the PNG's colour type)."""
    return image_type(data) == "image/png" and data[25:26] in (b"\x04", b"\x06")


def to_gltf_image(
    texture: Texture, colour: bool = True
) -> tuple[tuple[bytes, str] | None, list[Finding]]:
    """Return a texture as (bytes, MIME type) for glTF.

    JPEG and eight-bit PNG pass unchanged. Anything else that OpenImageIO reads becomes an
    eight-bit PNG: of a colour, floating-point values are taken as linear light and encoded
    with the sRGB curve, integers as encoded already; data keep their numbers.

    Parameters
    ----------
    texture : Texture
    colour : bool
        Whether it holds colours (base colour, emission) or data (normals, roughness, ...).

    Returns
    -------
    (bytes, str) or None
        None where the texture cannot be read.
    list of Finding
        TEXTURE_CONVERTED or TEXTURE_MISSING.

    Notes
    -----
    Source: glTF 2.0 specification, sections 3.8.3 (images) and 3.9 (colour spaces);
    IEC 61966-2-1 (sRGB).
    """
    where = Path(texture.path).name if texture.path else f"embedded {texture.suffix} image"
    try:
        data = _bytes_of(texture)
        mime = image_type(data)
        deep = mime == "image/png" and len(data) > 24 and data[24] == 16  # IHDR bit depth
        if mime and not deep:
            return (data, mime), []
        pixels, linear = _pixels(texture, data)
        encoded = _png(_eight_bit(pixels, encode=colour and linear))
    except InputError as error:
        return None, [finding("TEXTURE_MISSING", where, f"left out: {error}")]
    return (encoded, "image/png"), [finding("TEXTURE_CONVERTED", where)]


def _bytes_of(texture: Texture) -> bytes:
    if texture.data is not None:
        return texture.data
    try:
        if Path(texture.path).stat().st_size > _MAX_BYTES:
            raise InputError("the image file is larger than 1 GiB")
        return Path(texture.path).read_bytes()
    except (OSError, ValueError) as error:
        raise InputError(f"the image cannot be read: {error}") from error


def _pixels(texture: Texture, data: bytes) -> tuple[NDArray[np.float32], bool]:
    """Return (height, width, channels) floats and whether the file stores floats."""
    suffix = (texture.suffix or Path(texture.path).suffix).lstrip(".")
    suffix = suffix if suffix.isalnum() else "img"  # part of a file name below
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / f"image.{suffix}"
        file.write_bytes(data)
        source = oiio.ImageInput.open(str(file))
        if source is None:
            raise InputError(f"the image is not readable: {_first_line(oiio.geterror())}")
        try:
            spec = source.spec()
            if not 0 < spec.width * spec.height <= _MAX_PIXELS or spec.depth > 1 or spec.deep:
                raise InputError(
                    f"the image is {spec.width} x {spec.height} x {spec.depth}; expected a flat "
                    f"one of at most {_MAX_PIXELS} pixels"
                )
            linear = spec.format.basetype in (oiio.HALF, oiio.FLOAT, oiio.DOUBLE)
            # More channels than RGBA are render layers, depth and the like.
            channels = 4 if spec.nchannels >= 4 and spec.alpha_channel == 3 else 3
            channels = min(channels, spec.nchannels)
            pixels: Any = source.read_image(0, 0, 0, channels, oiio.FLOAT)
            if pixels is None:
                raise InputError(f"the image is not readable: {_first_line(source.geterror())}")
        finally:
            source.close()
    return np.nan_to_num(np.asarray(pixels, np.float32)), linear


def _eight_bit(pixels: NDArray[np.float32], encode: bool) -> NDArray[np.uint8]:
    channels = pixels.shape[2]
    colours = pixels[..., : channels - (channels in (2, 4))]
    if channels in (2, 4):  # OpenImageIO gives colours multiplied by alpha, PNG wants them plain
        alpha = pixels[..., -1:].clip(0, 1)
        colours = np.divide(colours, alpha, out=np.zeros_like(colours), where=alpha > 0)
    colours = colours.clip(0, 1)
    if encode:
        curve = 1.055 * np.power(colours, 1 / 2.4) - 0.055
        colours = np.where(colours <= 0.0031308, 12.92 * colours, curve)
    if channels in (2, 4):
        colours = np.concatenate([colours, alpha], axis=2)
    return np.round(colours * 255).astype(np.uint8)


def _png(pixels: NDArray[np.uint8]) -> bytes:
    height, width, channels = pixels.shape
    spec = oiio.ImageSpec(width, height, channels, "uint8")
    spec.attribute("oiio:UnassociatedAlpha", 1)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "image.png"
        target = oiio.ImageOutput.create(str(file))
        if target is None or not target.open(str(file), spec):
            raise InputError(f"the image cannot be written as PNG: {_first_line(oiio.geterror())}")
        written = target.write_image(np.ascontiguousarray(pixels)) and target.close()
        if not written:
            raise InputError(f"the image cannot be written as PNG: {target.geterror()}")
        return file.read_bytes()


def _first_line(text: str) -> str:
    return text.strip().splitlines()[0] if text.strip() else "unknown format"
