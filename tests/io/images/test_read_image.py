import zlib
from pathlib import Path
from struct import pack

import numpy as np
import OpenImageIO as oiio
import pytest

from usdface.errors import InputError
from usdface.io.images.read_image import exposure_of, read_header, read_image

RAMP = np.linspace(0.05, 0.95, 24 * 16 * 3).reshape(16, 24, 3)


def encoded(linear: np.ndarray) -> np.ndarray:
    return 255 * (1.055 * linear ** (1 / 2.4) - 0.055)


def write(path: Path, values: np.ndarray, kind: str, **attributes: object) -> Path:
    spec = oiio.ImageSpec(values.shape[1], values.shape[0], values.shape[2], kind)
    for name, value in attributes.items():
        spec.attribute(name.replace("__", ":"), value)
    file = oiio.ImageOutput.create(str(path))
    assert file.open(str(path), spec), oiio.geterror()
    assert file.write_image(np.ascontiguousarray(values.astype(np.float32)))
    file.close()
    return path


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


def test_a_display_window_of_too_many_pixels_is_refused(tmp_path: Path) -> None:
    path = windowed(tmp_path / "a.exr", (0, 0), (60_000, 60_000))
    for read in (read_image, read_header):
        with pytest.raises(InputError, match="60000 x 60000 pixels"):
            read(path)


@pytest.mark.parametrize("name", ["a.png", "a.tif"])
def test_a_position_on_a_page_is_none_in_the_image(tmp_path: Path, name: str) -> None:
    path = windowed(tmp_path / name, (5, 3), (40, 20))
    assert read_image(path).shape == (16, 24, 3) and read_header(path).size == (24, 16)


def bomb(path: Path, side: int = 60_000) -> Path:
    def chunk(kind: bytes, data: bytes) -> bytes:
        return pack(">I", len(data)) + kind + data + pack(">I", zlib.crc32(kind + data))

    head = pack(">IIBBBBB", side, side, 8, 2, 0, 0, 0)
    body = zlib.compress(bytes(100_000))
    path.write_bytes(
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", body) + chunk(b"IEND", b"")
    )
    return path


@pytest.mark.parametrize("side", [8_000, 60_000])
def test_an_image_that_claims_too_many_pixels_is_refused(tmp_path: Path, side: int) -> None:
    path = bomb(tmp_path / "a.png", side)
    for read in (read_image, read_header):
        with pytest.raises(InputError):
            read(path)


@pytest.mark.parametrize("name", ["a.png", "a.jpg", "a.exr", "a.tif", "a.dpx", "a.gif"])
def test_rubbish_is_refused_in_one_line(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    for rubbish in (b"", b"nonsense" * 50):
        path.write_bytes(rubbish)
        with pytest.raises(InputError) as caught:
            read_image(path)
        assert "\n" not in str(caught.value) and name in str(caught.value)


@pytest.mark.parametrize(
    ("name", "kind"), [("a.png", "uint8"), ("a.exr", "half"), ("a.tif", "uint8")]
)
def test_a_cut_off_image_is_refused(tmp_path: Path, name: str, kind: str) -> None:
    noisy = np.random.default_rng(0).uniform(size=(64, 64, 3))
    path = write(tmp_path / name, noisy, kind)
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    with pytest.raises(InputError, match="not readable"):
        read_image(path)
