import struct
import subprocess
import sys
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

from usdface.io.gltf.image import to_gltf_image
from usdface.io.gltf.image_kind import image_type
from usdface.rigs import Texture


def write_image(path: Path, pixels: np.ndarray, kind: str) -> Path:
    height, width, channels = pixels.shape
    target = oiio.ImageOutput.create(str(path))
    assert target.open(str(path), oiio.ImageSpec(width, height, channels, kind))
    assert target.write_image(pixels.astype(np.float32))
    target.close()
    return path


def read_image(data: bytes, folder: Path) -> np.ndarray:
    path = folder / "back.png"
    path.write_bytes(data)
    source = oiio.ImageInput.open(str(path))
    assert source.spec().format.basetype == oiio.UINT8
    config = oiio.ImageSpec()
    config.attribute("oiio:UnassociatedAlpha", 1)
    source = oiio.ImageInput.open(str(path), config)
    pixels = source.read_image("uint8")
    source.close()
    return pixels


def flat(*values: float) -> np.ndarray:
    return np.broadcast_to(np.array(values), (2, 3, len(values))).copy()


@pytest.mark.parametrize(("suffix", "mime"), [("png", "image/png"), ("jpg", "image/jpeg")])
def test_png_and_jpeg_pass_unchanged(tmp_path: Path, suffix: str, mime: str) -> None:
    path = write_image(tmp_path / f"a.{suffix}", flat(0.2, 0.4, 0.6), "uint8")
    assert to_gltf_image(Texture(str(path))) == ((path.read_bytes(), mime), [])
    inside = Texture(data=path.read_bytes(), suffix=".wrong")
    assert to_gltf_image(inside) == ((path.read_bytes(), mime), [])


@pytest.mark.parametrize(
    ("name", "kind", "value", "colour", "expected"),
    [
        # sRGB of middle grey and of the linear foot of the curve: IEC 61966-2-1
        ("a.exr", "half", 0.5, True, 188),
        ("a.exr", "float", 0.002, True, round(12.92 * 0.002 * 255)),
        ("a.exr", "half", 0.5, False, 128),
        ("a.exr", "float", 7.0, True, 255),
        ("a.exr", "float", -1.0, True, 0),
        ("a.tif", "uint8", 0.4, True, 102),
        ("a.tif", "uint16", 0.4, False, 102),
        ("a.png", "uint16", 0.4, True, 102),
    ],
)
def test_conversion_respects_the_colour_space(
    tmp_path: Path, name: str, kind: str, value: float, colour: bool, expected: int
) -> None:
    path = write_image(tmp_path / name, flat(value, value, value), kind)
    image, found = to_gltf_image(Texture(str(path)), colour)
    assert image is not None
    assert image[1] == image_type(image[0]) == "image/png"
    np.testing.assert_array_equal(read_image(image[0], tmp_path), np.full((2, 3, 3), expected))
    assert [(f.code, f.where) for f in found] == [("TEXTURE_CONVERTED", name)]


def test_alpha_is_not_multiplied_into_the_colours(tmp_path: Path) -> None:
    path = write_image(tmp_path / "a.exr", flat(0.25, 0.125, 0.0, 0.5), "float")
    image, _ = to_gltf_image(Texture(str(path)), colour=False)
    assert image is not None
    np.testing.assert_array_equal(read_image(image[0], tmp_path)[0, 0], [128, 64, 0, 128])


@pytest.mark.parametrize(("given", "kept"), [(1, 1), (3, 3), (4, 4), (6, 3)])
def test_channels(tmp_path: Path, given: int, kept: int) -> None:
    pixels = np.random.default_rng(given).random((2, 3, given))
    path = tmp_path / "a.exr"
    spec = oiio.ImageSpec(3, 2, given, "float")
    if given == 6:
        spec.channelnames = ("R", "G", "B", "depth", "id", "mask")
    target = oiio.ImageOutput.create(str(path))
    target.open(str(path), spec)
    target.write_image(pixels.astype(np.float32))
    target.close()
    image, _ = to_gltf_image(Texture(str(path)), colour=False)
    assert image is not None
    back = read_image(image[0], tmp_path)
    assert back.shape == (2, 3, kept)


def test_conversion_is_deterministic(tmp_path: Path) -> None:
    path = write_image(tmp_path / "a.tif", np.random.default_rng(0).random((8, 8, 3)), "uint16")
    assert to_gltf_image(Texture(str(path))) == to_gltf_image(Texture(str(path)))


def huge_png() -> bytes:
    header = struct.pack(">IIBBBBB", 2**30, 2**30, 16, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + struct.pack(">I4s", 13, b"IHDR") + header + bytes(40)


@pytest.mark.parametrize(
    "texture",
    [
        Texture("no/such/file.png"),
        Texture("a\0b.png"),
        Texture("."),
        Texture(data=b"", suffix=".exr"),
        Texture(data=b"garbage" * 20, suffix=".tif"),
        Texture(data=b"v/1\x01" + bytes(100), suffix=".exr"),
        Texture(data=b"#!/bin/sh", suffix="../../x"),
        Texture(data=huge_png(), suffix=".png"),
    ],
)
def test_what_cannot_be_read_is_announced(texture: Texture) -> None:
    image, found = to_gltf_image(texture)
    assert image is None
    assert [f.code for f in found] == ["TEXTURE_MISSING"]
    assert "\n" not in found[0].message


def test_a_truncated_image_is_announced(tmp_path: Path) -> None:
    pixels = np.random.default_rng(0).random((64, 64, 3))
    path = write_image(tmp_path / "a.tif", pixels, "uint16")
    path.write_bytes(path.read_bytes()[:2000])
    image, found = to_gltf_image(Texture(str(path)))
    assert image is None
    assert [f.code for f in found] == ["TEXTURE_MISSING"]


def test_a_large_flat_image_takes_little_memory(tmp_path: Path) -> None:
    path = tmp_path / "bomb.png"
    spec = oiio.ImageSpec(4096, 4096, 4, "uint16")
    target = oiio.ImageOutput.create(str(path))
    assert target.open(str(path), spec)
    row = np.full((1, 4096, 4), 0.5, np.float32)
    for y in range(4096):
        target.write_scanline(y, 0, row)
    target.close()
    code = (
        "import resource, sys\n"
        "from usdface.io.gltf.image import to_gltf_image\nfrom usdface.materials import Texture\n"
        "to_gltf_image(Texture(sys.argv[2]))\n"
        "before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss\n"
        "image, _ = to_gltf_image(Texture(sys.argv[1]))\n"
        "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)"
    )
    small = write_image(tmp_path / "small.png", flat(0.2, 0.4, 0.6, 1.0), "uint16")
    done = subprocess.run(
        [sys.executable, "-c", code, str(path), str(small)], capture_output=True, text=True
    )
    assert int(done.stdout) < 300 * 1024, done.stderr  # kB; 64 MB are the pixels


@pytest.mark.parametrize("tiles", [0, 64])
def test_strips_are_the_whole_image(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, tiles: int
) -> None:
    rng = np.random.default_rng(0)
    path = tmp_path / "a.exr"
    spec = oiio.ImageSpec(100, 150, 4, "float")
    spec.tile_width = spec.tile_height = tiles
    target = oiio.ImageOutput.create(str(path))
    assert target.open(str(path), spec)
    target.write_image(rng.uniform(0.1, 1, (150, 100, 4)).astype(np.float32))
    target.close()
    (whole, _), _ = to_gltf_image(Texture(str(path)))
    monkeypatch.setattr("usdface.io.gltf.image._STRIP", 1000)
    (strips, _), _ = to_gltf_image(Texture(str(path)))
    assert strips == whole


def test_a_small_file_of_many_pixels_is_refused_before_they_are_decoded(tmp_path: Path) -> None:
    data = bytearray(write_image(tmp_path / "a.webp", np.zeros((8, 8, 3)), "uint8").read_bytes())
    at = data.index(b"\x9d\x01\x2a") + 3 if b"\x9d\x01\x2a" in data else None
    if at is None:
        pytest.skip("this OpenImageIO writes lossless WebP")
    data[at : at + 4] = struct.pack("<HH", 9000, 7000)
    image, (found,) = to_gltf_image(Texture(data=bytes(data), suffix=".webp"))
    assert image is None and found.code == "TEXTURE_MISSING"
    # By a limit of OpenImageIO, or with older ones by ours.
    assert "exceeds" in found.message or "420 MB in memory" in found.message


def test_words_of_a_damaged_image_that_are_no_text_are_no_error(tmp_path: Path) -> None:
    good = write_image(tmp_path / "a.exr", np.zeros((8, 8, 3)), "half").read_bytes()
    for place in range(8, 200):
        data = good[:place] + b"\xd1\x80" + good[place + 2 :]
        to_gltf_image(Texture(data=data, suffix=".exr"))
