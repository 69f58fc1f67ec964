"""What is no image, or claims to be a huge one, is refused before it takes memory."""

import zlib
from pathlib import Path
from struct import pack

import pytest
from written_images import windowed

from usdface.errors import InputError
from usdface.io.images.image_header import read_header
from usdface.io.images.read_image import read_image


def test_a_display_window_of_too_many_pixels_is_refused(tmp_path: Path) -> None:
    path = windowed(tmp_path / "a.exr", (0, 0), (60_000, 60_000))
    for read in (read_image, read_header):
        with pytest.raises(InputError, match="60000 x 60000 pixels"):
            read(path)


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
