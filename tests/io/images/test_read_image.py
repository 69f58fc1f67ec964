"""Pixels of any image come upright, as code values for display."""

from pathlib import Path

import numpy as np
import pytest
from written_images import RAMP, windowed, write

from usdface.errors import InputError
from usdface.io.images.image_header import read_header
from usdface.io.images.read_image import exposure_of, read_image


def encoded(linear: np.ndarray) -> np.ndarray:
    return 255 * (1.055 * linear ** (1 / 2.4) - 0.055)


@pytest.mark.parametrize(
    ("name", "kind"), [("a.png", "uint8"), ("a.png", "uint16"), ("a.tif", "uint16")]
)
def test_integers_are_for_display_already(tmp_path: Path, name: str, kind: str) -> None:
    pixels = read_image(write(tmp_path / name, RAMP, kind))
    assert pixels.dtype == np.uint8
    assert np.abs(pixels - 255 * RAMP).max() <= 1.0


@pytest.mark.parametrize("kind", ["half", "float"])
def test_linear_light_is_encoded(tmp_path: Path, kind: str) -> None:
    pixels = read_image(write(tmp_path / "a.exr", RAMP, kind))
    assert np.abs(pixels - encoded(RAMP)).max() <= 1.0


def test_log_film_is_encoded(tmp_path: Path) -> None:
    white = np.full((8, 8, 3), 685 / 1023)
    path = write(tmp_path / "a.dpx", white, "uint10", dpx__Transfer="Printing density")
    assert read_image(path).min() > 200
    assert np.abs(read_image(write(tmp_path / "b.dpx", white, "uint10")) - 171).max() <= 1


def test_one_channel_becomes_three(tmp_path: Path) -> None:
    assert read_image(write(tmp_path / "a.png", RAMP[..., :1], "uint8")).shape == (16, 24, 3)


@pytest.mark.parametrize("orientation", range(1, 9))
def test_images_are_turned_upright(tmp_path: Path, orientation: int) -> None:
    """The stored image of an upright one, by the rule of Exif: where row 0 and column 0 are."""
    upright = (255 * RAMP).astype(np.uint8)
    stored = {
        1: upright,
        2: upright[:, ::-1],
        3: upright[::-1, ::-1],
        4: upright[::-1],
        5: upright.transpose(1, 0, 2),
        6: np.rot90(upright, 1),
        7: upright[::-1, ::-1].transpose(1, 0, 2),
        8: np.rot90(upright, -1),
    }[orientation]
    path = write(tmp_path / "a.tif", stored / 255, "uint8", Orientation=orientation)
    assert np.abs(read_image(path).astype(int) - upright).max() <= 1
    assert read_header(path).size == (24, 16)


def test_dark_and_bright_light_is_brought_to_a_display(tmp_path: Path) -> None:
    for factor in (0.01, 100.0):
        path = write(tmp_path / f"{factor}.exr", factor * RAMP, "float")
        pixels = read_image(path, exposure=exposure_of(path))
        assert 200 < np.percentile(pixels, 95) <= 255
    assert exposure_of(write(tmp_path / "usual.exr", RAMP, "half")) == 1.0


def test_what_is_no_number_is_black(tmp_path: Path) -> None:
    values = RAMP.copy()
    values[0, 0] = np.nan
    values[0, 1] = np.inf
    pixels = read_image(write(tmp_path / "a.exr", values, "half"))
    assert pixels[0, 0].max() == 0 and pixels[0, 1].min() == 255


@pytest.mark.parametrize("place", [(5, 3), (-4, -6), (30, 2), (0, 0)])
def test_a_data_window_is_placed_in_what_is_shown(tmp_path: Path, place: tuple[int, int]) -> None:
    """Renderers cut frames to what is not black, and add overscan."""
    path = windowed(tmp_path / "a.exr", place, (40, 20))
    pixels = read_image(path)
    assert (pixels.shape[1], pixels.shape[0]) == read_header(path).size == (40, 20)
    large = np.zeros((100, 100, 3))
    x, y = 40 + place[0], 40 + place[1]
    large[y : y + 16, x : x + 24] = encoded(RAMP)
    assert np.abs(pixels - large[40:60, 40:80]).max() <= 1.0


@pytest.mark.parametrize("name", ["a.png", "a.tif"])
def test_a_position_on_a_page_is_none_in_the_image(tmp_path: Path, name: str) -> None:
    path = windowed(tmp_path / name, (5, 3), (40, 20))
    assert read_image(path).shape == (16, 24, 3) and read_header(path).size == (24, 16)


@pytest.mark.parametrize(
    ("name", "kind"), [("a.png", "uint8"), ("a.exr", "half"), ("a.tif", "uint8")]
)
def test_a_cut_off_image_is_refused(tmp_path: Path, name: str, kind: str) -> None:
    noisy = np.random.default_rng(0).uniform(size=(64, 64, 3))
    path = write(tmp_path / name, noisy, kind)
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    with pytest.raises(InputError, match="not readable"):
        read_image(path)
