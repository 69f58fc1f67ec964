"""Images of a page: PNG or JPEG as browsers show them, no larger than a page needs."""

from typing import Any

import numpy as np

from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.io.gltf.image import pixels_of, to_gltf_image, to_png
from usdface.io.gltf.image_kind import image_type
from usdface.materials import Texture

__all__ = ["LARGEST_SIDE", "page_image", "smaller"]

# Pixels along the longer side: a face fills about as many of a screen.
LARGEST_SIDE = 1024


def page_image(texture: Texture) -> tuple[tuple[bytes, str] | None, list[Finding]]:
    """Return an image of colours as bytes and their MIME type, made smaller if need be.

    Returns
    -------
    (bytes, str) or None
        None where it cannot be read.
    list of Finding
        TEXTURE_CONVERTED or TEXTURE_MISSING.
    """
    image, found = to_gltf_image(texture)
    if image is None:
        return None, found
    try:
        pixels = pixels_of(Texture(data=image[0], suffix=f".{image_type(image[0])[6:]}"))
    except InputError as error:
        return None, [finding("TEXTURE_MISSING", texture.path, "left out: {error}", error)]
    height, width = pixels.shape[:2]
    step = max(height, width) / LARGEST_SIDE
    if step <= 1.0 and len(image[0]) <= 4 * pixels.size:
        return image, found
    # A small image in a large file has something else in it.
    return (to_png(smaller(pixels, step) if step > 1.0 else pixels), "image/png"), found


def smaller(pixels: np.ndarray[Any, Any], step: float) -> np.ndarray[Any, Any]:
    """Return an image whose pixels are the means of `step` x `step` ones."""
    for axis in (0, 1):
        size = pixels.shape[axis]
        count = max(1, round(size / step))
        edges = (np.arange(count) * size) // count
        widths = np.diff(edges, append=size).reshape([-1 if k == axis else 1 for k in range(3)])
        pixels = np.add.reduceat(pixels.astype(np.float32), edges, axis=axis) / widths
    return np.round(pixels).astype(np.uint8)
