from pathlib import Path

import pytest

from usdface.errors import InputError
from usdface.io.images.sequence import find_images, is_pattern, may_be_images


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for number in (9, 10, 12):
        (tmp_path / f"face.{number}.png").touch()
    (tmp_path / "notes.txt").touch()
    return tmp_path


@pytest.mark.parametrize(
    "name", ["face.#.png", "face.####.png", "face.%d.png", "face.%04d.png", ""]
)
def test_images_come_in_the_order_of_their_numbers_with_gaps(folder: Path, name: str) -> None:
    found = find_images(folder / name)
    assert [file.number for file in found] == [9, 10, 11, 12]
    assert [file.path and file.path.name for file in found] == [
        "face.9.png",
        "face.10.png",
        None,
        "face.12.png",
    ]


def test_padded_numbers_and_other_digits_in_a_name(tmp_path: Path) -> None:
    for number in (1, 2):
        (tmp_path / f"shot010_take2.{number:05d}.exr").touch()
    assert [file.number for file in find_images(tmp_path)] == [1, 2]
    assert len(find_images(tmp_path / "shot010_take2.#####.exr")) == 2


@pytest.mark.parametrize("pattern", ["", "face.####.png"])
def test_two_images_of_one_number_are_refused(folder: Path, pattern: str) -> None:
    (folder / "face.0010.png").touch()
    with pytest.raises(InputError, match=r"face\.10\.png are both frame 10") as caught:
        find_images(folder / pattern)
    assert caught.value.code == "NAME_REPEATED"


def test_one_image_is_a_sequence(folder: Path) -> None:
    assert [file.path for file in find_images(folder / "face.9.png")] == [folder / "face.9.png"]


def test_a_pattern_is_no_file_of_that_name(tmp_path: Path) -> None:
    odd = tmp_path / "take#1.png"
    assert is_pattern(odd)
    odd.touch()
    assert not is_pattern(odd) and len(find_images(odd)) == 1


def test_two_sequences_in_a_folder_are_named(folder: Path) -> None:
    (folder / "depth.9.exr").touch()
    with pytest.raises(InputError, match=r"2 sequences: depth\.####\.exr, face\.####\.png"):
        find_images(folder)


@pytest.mark.parametrize("name", ["other.####.png", "none.png"])
def test_nothing_of_that_name(folder: Path, name: str) -> None:
    with pytest.raises(InputError) as caught:
        find_images(folder / name)
    assert caught.value.code == "FILE_UNREADABLE"


def test_numbers_far_apart_are_no_frames(folder: Path) -> None:
    (folder / "face.20251122.png").touch()
    with pytest.raises(InputError, match="numbered 9 to 20251122") as caught:
        find_images(folder)
    assert caught.value.code == "TOO_LARGE"


def test_a_folder_of_very_many_files_is_listed(tmp_path: Path) -> None:
    for number in range(3000):
        (tmp_path / f"f{number:06d}.jpg").touch()
    assert len(find_images(tmp_path)) == 3000 and may_be_images(tmp_path)


def test_a_folder_without_images_is_none(tmp_path: Path) -> None:
    (tmp_path / "mesh.obj").touch()
    assert not may_be_images(tmp_path)
