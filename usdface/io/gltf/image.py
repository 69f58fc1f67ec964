"""Images as glTF holds them: PNG or JPEG, eight bits, sRGB for colours and linear for data."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.io.asset_folder import read_file
from usdface.io.gltf.image_kind import BY_LINES, image_type
from usdface.io.temporary_folder import temporary_folder
from usdface.materials import Texture

__all__ = ["GltfImage", "channels_image", "pixels_of", "to_gltf_image", "to_png"]

GltfImage = tuple[bytes, str]  # data and MIME type
_MAX_BYTES = 2**30  # of a file: more than _MAX_PIXELS as 32-bit colours
_MAX_FILE = 2**34  # bytes of all pixels and channels, most of them render layers
_MAX_PIXELS = 2**26  # 8192 x 8192; with four channels of a byte this is 256 MiB
_STRIP = 2**20  # pixels that are converted at a time
_MEMORY, _MEMORY_PER_BYTE = 200 * 2**20, 10  # bytes of all pixels, for those of the file
_UNKNOWN = "unknown format"


def to_gltf_image(texture: Texture, colour: bool = True) -> tuple[GltfImage | None, list[Finding]]:
    """Return a texture as (bytes, MIME type) for glTF.

    JPEG and eight-bit PNG pass unchanged, unless they hold a colour in linear light. Anything
    else that OpenImageIO reads becomes an eight-bit PNG: of a colour that does not name its
    space, floating-point values are taken as linear light and encoded with the sRGB curve,
    integers as encoded already; data keep their numbers.

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
    where = _name(texture)
    try:
        data = _bytes_of(texture)
        mime = image_type(data)
        deep = mime == "image/png" and len(data) > 24 and data[24] == 16  # IHDR bit depth
        if mime and not deep and not (colour and texture.space == "raw"):
            return (data, mime), []
        encoded = to_png(_eight_bit_pixels(texture, data, colour))
    except InputError as error:
        return None, [finding("TEXTURE_MISSING", where, "left out: {error}", error)]
    return (encoded, "image/png"), [finding("TEXTURE_CONVERTED", where)]


def channels_image(
    planes: Sequence[Texture | None], colour: bool
) -> tuple[GltfImage | None, list[Finding]]:
    """Return one PNG made of the channels that textures name; None stands for 1 everywhere.

    Parameters
    ----------
    planes : sequence of Texture or None
        Red, green and blue; or, of a `colour`, the texture of all three and that of alpha
        (None for no alpha channel).
    colour : bool

    Returns
    -------
    (bytes, str) or None
        None where no texture can be read. Textures of different sizes are repeated to the
        largest.
    list of Finding
    """
    found: list[Finding] = []
    read: dict[Texture, NDArray[np.uint8] | None] = {}
    for plane in dict.fromkeys(plane for plane in planes if plane is not None):
        try:
            coloured = colour and plane is planes[0]
            read[plane] = _eight_bit_pixels(plane, _bytes_of(plane), coloured)
        except InputError as error:
            read[plane] = None
            found.append(finding("TEXTURE_MISSING", _name(plane), "left out: {error}", error))
    known = [pixels for pixels in read.values() if pixels is not None]
    if not known:
        return None, found
    size = max(p.shape[0] for p in known), max(p.shape[1] for p in known)
    blank = np.full((*size, 3), 255, np.uint8)
    parts: list[NDArray[np.uint8]] = []
    for place, texture in enumerate(planes):
        pixels = None if texture is None else read[texture]
        whole = colour and place == 0
        if texture is None or pixels is None:
            if whole or not colour:
                parts.append(blank if whole else blank[..., :1])
            continue
        pixels = _sized(pixels, size)
        parts.append(_rgb(pixels) if whole else _channel(pixels, texture.channel))
    names = " and ".join(_name(texture) for texture in read)
    message = "channels were put into one PNG, as glTF wants them"
    found.append(finding("TEXTURE_CONVERTED", names, message))
    return (to_png(np.concatenate(parts, axis=2)), "image/png"), found


def _sized(pixels: NDArray[np.uint8], size: tuple[int, int]) -> NDArray[np.uint8]:
    rows, columns = (np.arange(n) * pixels.shape[k] // n for k, n in enumerate(size))
    return np.asarray(pixels[rows][:, columns])


def _rgb(pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return three channels of an image that may be grey."""
    return pixels[..., :3] if pixels.shape[2] > 2 else np.repeat(pixels[..., :1], 3, axis=2)


def _channel(pixels: NDArray[np.uint8], name: str) -> NDArray[np.uint8]:
    """Return one channel (height, width, 1); a grey image has its grey in r, g and b."""
    count = pixels.shape[2]
    if name == "a":
        return pixels[..., -1:] if count in (2, 4) else np.full_like(pixels[..., :1], 255)
    place = "rgb".find(name) if count > 2 else 0
    return pixels[..., place : place + 1] if place >= 0 else pixels[..., :1]


def _name(texture: Texture) -> str:
    return Path(texture.path).name if texture.path else f"embedded {texture.suffix} image"


def _eight_bit_pixels(texture: Texture, data: bytes, colour: bool) -> NDArray[np.uint8]:
    """Return (height, width, channels), converted in strips, which as floats are larger."""
    import OpenImageIO as oiio  # a fifth of a small conversion; most images pass unchanged

    suffix = (texture.suffix or Path(texture.path).suffix).lstrip(".")
    suffix = suffix if suffix.isalnum() else "img"  # part of a file name below
    with temporary_folder() as folder:
        file = folder / f"image.{suffix}"
        file.write_bytes(data)
        by_lines = data.startswith(BY_LINES)
        with _limited(
            oiio, _MAX_FILE if by_lines else (_MEMORY + _MEMORY_PER_BYTE * len(data)) // 3
        ):
            source = oiio.ImageInput.open(str(file))
        if source is None:
            raise InputError(f"the image is not readable: {_fault(oiio)}")
        try:
            spec = source.spec()
            _check_size(spec, by_lines, len(data))
            floating = spec.format.basetype in (oiio.HALF, oiio.FLOAT, oiio.DOUBLE)
            linear = texture.space == "raw" or (texture.space == "auto" and floating)
            pixels, top = np.empty((0, 0, 0), np.uint8), 0
            for strip in _strips(source, spec):
                if top == 0:
                    pixels = np.empty((spec.height, *strip.shape[1:]), np.uint8)
                pixels[top : top + len(strip)] = _eight_bit(strip, colour and linear)
                top += len(strip)
        finally:
            source.close()
    return pixels


@contextmanager
def _limited(oiio: Any, most: int) -> Iterator[None]:
    """Let OpenImageIO refuse images of more bytes before it allocates them."""
    name = "limits:imagesize_MB"
    before = oiio.get_int_attribute(name)
    oiio.attribute(name, max(1, most >> 20))
    try:
        yield
    finally:
        oiio.attribute(name, before)


def _check_size(spec: Any, by_lines: bool, size: int) -> None:
    """Refuse an image whose pixels take more memory than its file and its use warrant."""
    flat = spec.depth <= 1 and not spec.deep
    if not (0 < spec.width * spec.height <= _MAX_PIXELS and flat):
        raise InputError(
            f"the image is {spec.width} x {spec.height} x {spec.depth}; expected a flat "
            f"one of at most {_MAX_PIXELS} pixels"
        )
    # Ours, those of a decoder that holds the whole image, and a row of tiles as floats, thrice.
    channels = min(spec.nchannels, 4) + (0 if by_lines else 4 * spec.format.size())
    memory = spec.width * (spec.height * channels + spec.tile_height * 3 * 16)
    if memory > _MEMORY + _MEMORY_PER_BYTE * size:
        raise InputError(
            f"the image is {spec.width} x {spec.height}, {memory >> 20} MB in memory, in a file of "
            f"{size} bytes; is it damaged?",
            "TOO_LARGE",
        )


def _bytes_of(texture: Texture) -> bytes:
    if texture.data is not None:
        return texture.data
    return read_file(Path(texture.path), _MAX_BYTES)


def _strips(source: Any, spec: Any) -> Iterator[NDArray[np.float32]]:
    """Yield (rows, width, channels) floats from top to bottom."""
    import OpenImageIO as oiio

    # More channels than RGBA are render layers, depth and the like.
    channels = 4 if spec.nchannels >= 4 and spec.alpha_channel == 3 else 3
    channels = min(channels, spec.nchannels)
    height = spec.tile_height or 1
    step = max(1, _STRIP // (spec.width * height)) * height
    for top in range(spec.y, spec.y + spec.height, step):
        end = min(top + step, spec.y + spec.height)
        if spec.tile_width:
            across = spec.x, spec.x + spec.width
            pixels = source.read_tiles(0, 0, *across, top, end, 0, 1, 0, channels, oiio.FLOAT)
        else:
            pixels = source.read_scanlines(0, 0, top, end, 0, 0, channels, oiio.FLOAT)
        fault = _fault(source)  # OpenImageIO before 3.1.8 fills in missing pixels
        if pixels is None or fault != _UNKNOWN:
            raise InputError(f"the image is not readable: {fault}")
        yield np.nan_to_num(np.asarray(pixels, np.float32)).reshape(-1, spec.width, channels)


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


def pixels_of(texture: Texture) -> NDArray[np.uint8]:
    """Return the colours of an image as (height, width, channels), sRGB, eight bits.

    Raises
    ------
    InputError
        If it cannot be read, or is too large.
    """
    return _eight_bit_pixels(texture, _bytes_of(texture), colour=True)


def to_png(pixels: NDArray[np.uint8]) -> bytes:
    """Return pixels (height, width, channels) as a PNG file; alpha is not multiplied in.

    Raises
    ------
    InputError
        If PNG holds no such image.
    OutputError
        If the disk of temporary files is full.
    """
    from usdface.io.images.encode import encode_image  # loads OpenImageIO only here

    return encode_image(pixels, ".png", {"oiio:UnassociatedAlpha": 1})


def _fault(source: Any) -> str:
    """Return the first line of the last error of OpenImageIO, which may quote a damaged file."""
    try:
        text = str(source.geterror())
    except UnicodeDecodeError as error:
        text = error.object.decode("utf-8", "backslashreplace")
    return text.strip().splitlines()[0] if text.strip() else _UNKNOWN
