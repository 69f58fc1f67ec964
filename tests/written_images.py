"""Images that tests write: with attributes of a header, or in a window."""

from pathlib import Path

import numpy as np
import OpenImageIO as oiio

RAMP = np.linspace(0.05, 0.95, 24 * 16 * 3).reshape(16, 24, 3)


def write(path: Path, values: np.ndarray, kind: str, **attributes: object) -> Path:
    spec = oiio.ImageSpec(values.shape[1], values.shape[0], values.shape[2], kind)
    for name, value in attributes.items():
        spec.attribute(name.replace("__", ":"), value)
    file = oiio.ImageOutput.create(str(path))
    assert file.open(str(path), spec), oiio.geterror()
    assert file.write_image(np.ascontiguousarray(values.astype(np.float32)))
    file.close()
    return path


def windowed(path: Path, place: tuple[int, int], shown: tuple[int, int]) -> Path:
    """`RAMP` at a place of a display window that has another size."""
    spec = oiio.ImageSpec(24, 16, 3, "half")
    spec.x, spec.y = place
    spec.full_x, spec.full_y, spec.full_width, spec.full_height = 0, 0, *shown
    file = oiio.ImageOutput.create(str(path))
    assert file.open(str(path), spec), oiio.geterror()
    assert file.write_image(np.ascontiguousarray(RAMP.astype(np.float32)))
    file.close()
    return path
