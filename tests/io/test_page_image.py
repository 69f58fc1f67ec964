import numpy as np
import pytest

from usdface.io.gltf.image import pixels_of, to_png
from usdface.io.page_image import LARGEST_SIDE, page_image
from usdface.materials import Texture


def texture(pixels: np.ndarray) -> Texture:
    return Texture(data=to_png(pixels), suffix=".png")


def test_a_small_image_passes_unchanged() -> None:
    small = texture(np.full((40, 60, 3), 90, np.uint8))
    image, found = page_image(small)
    assert image == (small.data, "image/png") and not found


@pytest.mark.parametrize("channels", [3, 4])
def test_a_large_image_is_averaged_down(channels: int) -> None:
    size = 2 * LARGEST_SIDE
    pixels = np.zeros((size // 4, size, channels), np.uint8)
    pixels[:, ::2] = 200
    pixels[..., 3:] = 255
    image, _ = page_image(texture(pixels))
    assert image is not None
    shown = pixels_of(Texture(data=image[0], suffix=".png"))
    assert shown.shape == (LARGEST_SIDE // 4, LARGEST_SIDE, channels)
    assert (shown[..., :3] == 100).all() and (shown[..., 3:] == 255).all()


def test_a_file_that_is_much_larger_than_its_image_is_written_anew() -> None:
    pixels = np.full((4, 4, 3), 90, np.uint8)
    image, _ = page_image(Texture(data=to_png(pixels) + bytes(10_000), suffix=".png"))
    assert image is not None and len(image[0]) < 1000
    shown = pixels_of(Texture(data=image[0], suffix=".png"))
    np.testing.assert_array_equal(shown, pixels)


def test_what_is_no_image_is_reported() -> None:
    image, found = page_image(Texture(data=b"no image", suffix=".png"))
    assert image is None and [f.code for f in found] == ["TEXTURE_MISSING"]


def test_a_damaged_png_is_reported() -> None:
    good = to_png(np.full((64, 64, 3), 7, np.uint8))
    image, found = page_image(Texture(data=good[:40], suffix=".png"))
    assert image is None and [f.code for f in found] == ["TEXTURE_MISSING"]
