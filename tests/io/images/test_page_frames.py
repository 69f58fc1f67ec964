from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

from usdface.errors import InputError
from usdface.io.images.page_frames import read_page_frames

SIZE = (32, 24)
BOX = (0, 0, *SIZE)


def film(folder: Path, first: int) -> Path:
    """Five images, each lighter than the one before."""
    for number in range(5):
        image = oiio.ImageBuf(oiio.ImageSpec(*SIZE, 3, "uint8"))
        image.set_pixels(image.roi, np.full((*SIZE[::-1], 3), 0.2 * number, dtype=np.float32))
        assert image.write(str(folder / f"face.{first + number:04d}.png"))
    return folder / "face.####.png"


@pytest.mark.parametrize("first", [0, 1, 101])
def test_frames_are_counted_from_the_first_image(tmp_path: Path, first: int) -> None:
    path = film(tmp_path, first)
    every = read_page_frames(path, range(5), BOX, SIZE)
    assert len(set(every.values())) == 5
    assert read_page_frames(path, [2, 4], BOX, SIZE) == {2: every[2], 4: every[4]}


def test_frames_may_be_counted_by_the_numbers_of_the_files(tmp_path: Path) -> None:
    """Frame 1003 of a program that counts from 1 is the 1002nd after its first."""
    path = film(tmp_path, 1001)
    every = read_page_frames(path, range(5), BOX, SIZE)
    assert read_page_frames(path, [1002, 1004], BOX, SIZE) == {1002: every[2], 1004: every[4]}


@pytest.mark.parametrize("frames", [[-1], [0, 5], [2, 1005]])
def test_frames_that_the_film_does_not_have_are_refused(tmp_path: Path, frames: list[int]) -> None:
    with pytest.raises(InputError, match="has 5 images; the take has a frame"):
        read_page_frames(film(tmp_path, 1001), frames, BOX, SIZE)


@pytest.mark.parametrize("size", [(16, 12), (64, 48), (43, 24)])
def test_images_of_another_size_are_refused(tmp_path: Path, size: tuple[int, int]) -> None:
    with pytest.raises(InputError, match="has 32 x 24 pixels, the take is of images of"):
        read_page_frames(film(tmp_path, 0), [0], (0, 0, 8, 8), size)
