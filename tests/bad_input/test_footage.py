"""Films that cannot be read, and those that can in part: one line, or findings and a take."""

import json
import struct
import tracemalloc
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from painted import layout, paint, performance
from spoilt import Place, Refused

from usdface.arrays import FloatArray
from usdface.cli import main
from usdface.footage.colour_channel import Pixels
from usdface.io.takes.files import read_take

COUNT = 6


def save(pixels: Pixels, path: Path, kind: str = "uint8", factor: float = 1.0) -> None:
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], 3, kind)
    file = oiio.ImageOutput.create(str(path))
    assert file.open(str(path), spec), oiio.geterror()
    values = pixels if kind == "uint8" else (factor * (pixels / 255.0) ** 2.2).astype(np.float32)
    if kind == "uint16":
        values = (pixels.astype(np.uint16) * 257).astype(np.uint16)
    assert file.write_image(np.ascontiguousarray(values))
    file.close()


def many_dots() -> Pixels:
    y, x = np.mgrid[:21, :21]
    places = np.stack([x.ravel(), y.ravel()], axis=1) * 18.0 + 18.0
    return paint(places, radius=4.0, size=(400, 400))


def photoshop(path: Path, pixels: Pixels) -> None:
    """Write the simplest PSD: no layers, planes one after the other, as its specification says."""
    height, width, _ = pixels.shape
    head = struct.pack(">4sH6xHIIHH", b"8BPS", 1, 3, height, width, 8, 3)
    path.write_bytes(
        head + 3 * struct.pack(">I", 0) + bytes(2) + pixels.transpose(2, 0, 1).tobytes()
    )


@pytest.fixture
def places() -> FloatArray:
    return performance(COUNT)[0]


def film(place: Place, places: FloatArray, suffix: str = "png", **given: object) -> Path:
    for number, row in enumerate(places):
        save(paint(row, seed=number), place / f"face.{number:04d}.{suffix}", **given)
    return place / f"face.####.{suffix}"


def none(place: Place) -> None:
    save(paint(np.zeros((0, 2))), place / "face.0000.png")


def too_many(place: Place) -> None:
    save(many_dots(), place / "face.0000.png")


def another_size(place: Place) -> None:
    for number, size in enumerate([(280, 220), (300, 220)]):
        save(paint(layout(), size=size), place / f"face.{number:04d}.png")


def corrupted(place: Place) -> None:
    for number in range(3):
        (place / f"face.{number:04d}.png").write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(200))


def bomb(place: Place) -> None:
    """A PNG of 100 bytes that claims 60,000 x 60,000 pixels."""
    size = struct.pack(">IIBBBBB", 60_000, 60_000, 8, 2, 0, 0, 0)
    chunks = [(b"IHDR", size), (b"IDAT", zlib.compress(bytes(100))), (b"IEND", b"")]
    parts = [
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        for kind, data in chunks
    ]
    (place / "face.0000.png").write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(parts))


@pytest.mark.parametrize(
    ("spoil", "options", "message"),
    [
        (none, (), "no dots are found"),
        pytest.param(too_many, (), "expected at most 400", marks=pytest.mark.slow),
        (none, ("--dots", "mauve"), "'mauve' is not known"),
        (none, ("--dots", "blue"), "dots"),
        (another_size, (), "300 x 220 pixels; expected 280 x 220"),
        (corrupted, (), "face.0000.png"),
        (bomb, (), "face.0000.png"),
    ],
)
def test_a_film_without_a_take(
    place: Place,
    refused: Refused,
    spoil: Callable[[Place], None],
    options: tuple[str, ...],
    message: str,
) -> None:
    spoil(place)
    refusal = refused(["take", place / "face.####.png", "-o", place / "x.usda", *options])
    assert message in refusal


def codes_of(place: Place, images: Path) -> list[str]:
    command = ["take", str(images), "-o", str(place / "x.usda"), "--fps", "30"]
    assert main([*command, "--report", str(place / "x.json")]) == 0
    return [each["code"] for each in json.loads((place / "x.json").read_text())["findings"]]


@pytest.mark.slow
def test_cuts_and_missing_images_are_findings(place: Place, places: FloatArray) -> None:
    film(place, np.concatenate([places, 0.45 * places + (150.0, 120.0)]))
    (place / "face.0002.png").unlink()
    found = codes_of(place, place / "face.####.png")
    assert {"FRAMES_DROPPED", "FOOTAGE_CUT"} <= set(found)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("suffix", "given"),
    [
        ("png", {"kind": "uint16"}),
        pytest.param("exr", {"kind": "half"}, marks=pytest.mark.slow),
        ("exr", {"kind": "float", "factor": 40.0}),
        ("hdr", {"kind": "float", "factor": 0.02}),
    ],
)
def test_deep_and_bright_images_are_films(
    place: Place, places: FloatArray, suffix: str, given: dict[str, object]
) -> None:
    assert codes_of(place, film(place, places, suffix, **given)).count("DOTS_FOUND") == 1
    take, _ = read_take(place / "x.usda")
    assert len(take.times) == COUNT and len(take.names) == 20


def test_an_image_of_photoshop_is_one(place: Place) -> None:
    photoshop(place / "face.psd", paint(layout()))
    assert "DOTS_FOUND" in codes_of(place, place / "face.psd")
    (place / "x.usda").unlink()


def test_a_cut_off_image_of_photoshop_is_refused(place: Place, refused: Refused) -> None:
    photoshop(place / "face.psd", paint(layout()))
    data = (place / "face.psd").read_bytes()
    (place / "face.psd").write_bytes(data[: len(data) // 3])
    assert "face.psd" in refused(["take", place / "face.psd", "-o", place / "x.usda"])


@pytest.mark.slow
def test_memory_does_not_grow_with_the_film(place: Place, places: FloatArray) -> None:
    pattern = film(place, places)
    size = 280 * 220 * 3
    for number in range(COUNT, 40):
        (place / f"face.{number:04d}.png").symlink_to(place / f"face.{number % COUNT:04d}.png")
    tracemalloc.start()
    try:
        read_take(pattern)
        _, most = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert most < 40 * size  # of all images at once
