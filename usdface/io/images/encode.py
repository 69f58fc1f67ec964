"""Images as the bytes of a file, encoded by OpenImageIO."""

from collections.abc import Mapping

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from usdface.errors import InputError
from usdface.io.images.image_file import fault_of
from usdface.io.temporary_folder import temporary_folder, temporary_full

__all__ = ["encode_image"]

# The last bytes of a whole file. OpenImageIO 3.1 reports no error where a disk is full.
_ENDS = {".png": b"IEND\xaeB`\x82", ".jpg": b"\xff\xd9"}
_HEADER = 4096  # bytes beside those of the pixels, at most


def encode_image(
    pixels: NDArray[np.uint8], suffix: str, attributes: Mapping[str, int | str]
) -> bytes:
    """Return pixels (height, width, channels) as a file.

    Parameters
    ----------
    pixels : (height, width, channels) array of uint8
    suffix : {".png", ".jpg"}
    attributes : mapping of str to int or str
        Attributes of OpenImageIO.

    Raises
    ------
    InputError
        If the format holds no such image.
    OutputError
        If the disk of temporary files is full.
    """
    height, width, channels = pixels.shape
    spec = oiio.ImageSpec(width, height, channels, "uint8")
    for name, value in attributes.items():
        spec.attribute(name, value)
    with temporary_folder() as folder:
        file = folder / f"image{suffix}"
        # libjpeg ends the process where a disk is full, so room is tried first; libpng does not.
        file.write_bytes(bytes(pixels.nbytes + _HEADER if suffix == ".jpg" else 0))
        target = oiio.ImageOutput.create(str(file))
        if target is None or not target.open(str(file), spec):
            fault = fault_of(oiio if target is None else target)
            raise InputError(f"the image cannot be written as {suffix[1:].upper()}: {fault}")
        written = target.write_image(np.ascontiguousarray(pixels))
        whole = target.close() and written
        data = file.read_bytes()
        if not whole or not data.endswith(_ENDS[suffix]):
            fault = fault_of(target).strip() if target.has_error else "the disk is full"
            raise temporary_full(fault)
        return data
