"""A photograph of a face with 21 dots, warped by a known motion: real skin and light."""

from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from scipy import ndimage

from usdface.arrays import FloatArray
from usdface.io.images.footage import read_footage
from usdface.io.images.read_image import read_image
from usdface.options import TakeOptions

PHOTOGRAPH = Path(__file__).resolve().parents[4] / "shared" / "data" / "marked_photo" / "jc.jpg"
FACE = slice(340, 1140), slice(290, 970)
DOTS, FRAMES = 21, 20
MIDDLE = np.array([170.0, 200.0])  # of the face at half its size [px]
# Places of local motions [px] in the face, and how far each reaches.
BUMPS = np.array([[125.0, 260.0], [215.0, 260.0], [170.0, 325.0], [115.0, 115.0]])
REACH = 45.0
CENTRE_ERROR = 0.15  # px, RMS of each coordinate


@pytest.mark.slow
def test_dots_of_a_warped_photograph_are_followed(tmp_path: Path) -> None:
    if not PHOTOGRAPH.exists():
        pytest.skip("needs ../shared/data/marked_photo")
    picture = halved(read_image(PHOTOGRAPH)[FACE])
    truth = np.stack([moved_places(dot_centres(picture), frame) for frame in range(FRAMES)])
    for frame in range(FRAMES):
        save(warped(picture, frame), tmp_path / f"face.{frame:04d}.png")
    take, footage, _ = read_footage(tmp_path, TakeOptions(rate=30.0))
    assert len(take.names) == DOTS
    places = footage.tracks.places
    assert not np.isnan(places).any()
    own = np.linalg.norm(places[0][:, None] - truth[0], axis=2).argmin(axis=1)
    assert sorted(own.tolist()) == list(range(DOTS))
    error = places - truth[:, own]
    assert np.abs(error).max() < 1.0  # no dot changes its name: neighbours are 30 px apart
    assert np.sqrt(np.mean(error**2)) < CENTRE_ERROR
    assert np.linalg.norm(truth - truth[0], axis=2).max() > 20.0
    assert not footage.tracks.doubts


def halved(picture: np.ndarray) -> np.ndarray:
    height, width = (side // 2 for side in picture.shape[:2])
    blocks = picture.reshape(height, 2, width, 2, 3)
    return np.asarray(np.rint(blocks.mean(axis=(1, 3))), dtype=np.uint8)


def dot_centres(picture: np.ndarray) -> FloatArray:
    """Return the centres (M, 2) [px] of green areas: where the dots are before the warp."""
    values = picture.astype(float)
    green = values[..., 1] - values[..., ::2].max(axis=2) > 40
    areas, count = ndimage.label(green)
    assert count == DOTS
    return np.array(ndimage.center_of_mass(green, areas, range(1, count + 1)))[:, ::-1] + 0.5


def source(places: FloatArray, frame: int) -> FloatArray:
    """Return where in the photograph places (..., 2) [px] of a frame come from.

    A similarity about the face's middle, then a shift within reach of each place of `BUMPS`.
    """
    phase = 2 * np.pi * frame / FRAMES
    turn, size = 0.10 * np.sin(phase), 1.0 + 0.06 * np.sin(2 * phase)
    cos, sin = size * np.cos(turn), size * np.sin(turn)
    back = (places - MIDDLE) @ np.array([[cos, -sin], [sin, cos]])
    back += MIDDLE + np.array([15.0 * np.sin(phase), 9.0 * np.sin(2 * phase)])
    shift = np.zeros_like(back)
    for number, bump in enumerate(BUMPS):
        away = np.exp(-0.5 * ((back - bump) ** 2).sum(axis=-1) / REACH**2)
        shift[..., 0] += 1.5 * np.sin((1 + number) * phase) * away
        shift[..., 1] += 4.5 * np.sin((2 + number) * phase) * away
    return back + shift


def moved_places(centres: FloatArray, frame: int) -> FloatArray:
    """Return where places (M, 2) of the photograph are in a frame: the inverse of `source`."""
    places = centres.copy()
    for _ in range(60):
        places -= 0.8 * (source(places, frame) - centres)
    assert np.abs(source(places, frame) - centres).max() < 1e-6
    return places


def warped(picture: np.ndarray, frame: int) -> np.ndarray:
    height, width = picture.shape[:2]
    pixels = np.stack(np.meshgrid(np.arange(width), np.arange(height)), axis=-1) + 0.5
    x, y = np.moveaxis(source(pixels, frame) - 0.5, -1, 0)
    channels = [
        ndimage.map_coordinates(picture[..., k], [y, x], order=1, mode="nearest") for k in range(3)
    ]
    return np.stack(channels, axis=-1)


def save(pixels: np.ndarray, path: Path) -> None:
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], 3, "uint8")
    spec.attribute("png:compressionLevel", 1)
    file = oiio.ImageOutput.create(str(path))
    assert file.open(str(path), spec), oiio.geterror()
    assert file.write_image(np.ascontiguousarray(pixels))
    file.close()
