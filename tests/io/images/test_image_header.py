"""The header of an image says size, rate, time code and focal length."""

from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from written_images import RAMP, write

from usdface.io.images.image_header import read_header


def test_the_header_says_rate_timecode_and_focal_length(tmp_path: Path) -> None:
    path = write(
        tmp_path / "a.exr", RAMP, "half", FramesPerSecond=24.0, Exif__FocalLengthIn35mmFilm=36
    )
    header = read_header(path)
    assert (header.rate, header.focal) == (24.0, 24.0)
    spec = oiio.ImageSpec(24, 16, 3, "uint10")
    spec.attribute("smpte:TimeCode", "timecode", (0x01020304, 0))
    spec.attribute("dpx:FrameRate", 25.0)
    file = oiio.ImageOutput.create(str(tmp_path / "a.dpx"))
    assert file.open(str(tmp_path / "a.dpx"), spec)
    file.write_image(np.zeros((16, 24, 3), np.float32))
    file.close()
    header = read_header(tmp_path / "a.dpx")
    assert (header.timecode, header.rate) == ("01:02:03:04", 25.0)


@pytest.mark.parametrize(("orientation", "aspect"), [(1, 2.0), (6, 0.5)])
def test_the_aspect_of_pixels_is_that_of_the_upright_image(
    tmp_path: Path, orientation: int, aspect: float
) -> None:
    path = write(tmp_path / "a.exr", RAMP, "half", PixelAspectRatio=2.0, Orientation=orientation)
    assert read_header(path).pixel_aspect == aspect
