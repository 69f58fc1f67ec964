"""Image sequences: `face.####.png`, `face.%04d.png`, a folder, one image of a sequence, a GIF."""

import os
import re
from dataclasses import dataclass
from pathlib import Path

from usdface.errors import InputError

__all__ = [
    "IMAGE_SUFFIXES",
    "MOVIE_SUFFIXES",
    "ImageFile",
    "find_images",
    "is_pattern",
    "may_be_images",
]

IMAGE_SUFFIXES = (
    *(".png", ".jpg", ".jpeg", ".jpe", ".tif", ".tiff", ".exr", ".dpx", ".cin", ".gif"),
    *(".bmp", ".tga", ".webp", ".hdr", ".jp2", ".jxl", ".ppm", ".pgm", ".psd", ".iff", ".sgi"),
)
MOVIE_SUFFIXES = (".mov", ".mp4", ".m4v", ".avi", ".mkv", ".webm", ".mpg", ".mxf")
_PATTERN = re.compile(r"#+|%0?\d*d|@+")
_NUMBER = re.compile(r"(\d+)(?=\D*$)")
# Frames that a sequence may have: an hour at 120 images a second. And how far apart its numbers may
# lie for the images there are: a number of another kind is no frame.
_MOST, _SPARSE = 432_000, 20
_ENTRIES = 2_000_000  # of a folder


@dataclass(frozen=True, slots=True)
class ImageFile:
    """An image of a sequence: its frame number and file; None = the file is missing."""

    number: int
    path: Path | None


def is_pattern(path: Path) -> bool:
    """Return whether the name of a path stands for many files."""
    return bool(_PATTERN.search(path.name)) and not path.exists()


def may_be_images(path: Path) -> bool:
    """Return whether a path is a pattern of images, an image, a movie, or a folder of images."""
    if path.is_dir():
        return _first_image(path)
    return path.suffix.lower() in (*IMAGE_SUFFIXES, *MOVIE_SUFFIXES)


def _first_image(folder: Path) -> bool:
    try:
        with os.scandir(folder) as entries:
            for count, entry in enumerate(entries):
                if Path(entry.name).suffix.lower() in IMAGE_SUFFIXES:
                    return True
                if count > 1000:
                    return False
    except OSError:
        return False
    return False


def find_images(path: Path) -> tuple[ImageFile, ...]:
    """Return the images of a sequence by their numbers, without a gap: a missing one has no file.

    Parameters
    ----------
    path : Path
        A pattern with ``#``, ``@`` or ``%04d``, a folder with the images of one sequence, or one
        image. Of several digits in a name the last group counts.

    Raises
    ------
    InputError
        If there is no such image, a folder holds several sequences, numbers are far apart, or two
        images have the same.
    """
    if path.is_dir():
        return _of_folder(path)
    if not is_pattern(path):
        if not path.is_file():
            raise InputError(f"no such file: {path}", "FILE_UNREADABLE")
        return (ImageFile(0, path),)
    head, tail = _PATTERN.split(path.name, maxsplit=1)
    named = re.compile(rf"{re.escape(head)}(\d+){re.escape(tail)}")
    found: dict[int, Path] = {}
    for name in _names(path.parent):
        match = named.fullmatch(name)
        if match:
            _add(found, int(match[1]), path.parent / name)
    if not found:
        raise InputError(
            f"no image is named like {path}; a # or %04d stands for the number of the frame",
            "FILE_UNREADABLE",
        )
    return _without_gaps(path, found)


def _of_folder(folder: Path) -> tuple[ImageFile, ...]:
    sequences: dict[tuple[str, str], dict[int, Path]] = {}
    for name in _names(folder):
        suffix = Path(name).suffix.lower()
        if suffix not in IMAGE_SUFFIXES or name.startswith("."):
            continue
        stem = name[: -len(suffix)]
        match = _NUMBER.search(stem)
        if match:
            kind = stem[: match.start()], stem[match.end() :] + suffix
            _add(sequences.setdefault(kind, {}), int(match[1]), folder / name)
    if not sequences:
        raise InputError(
            f"{folder} has no numbered images, like face.0001.png; rename them, or name one file",
            "FILE_UNREADABLE",
        )
    if len(sequences) > 1:
        shown = ", ".join(f"{a}####{b}" for a, b in sorted(sequences)[:4])
        raise InputError(
            f"{folder} has images of {len(sequences)} sequences: {shown}; name one of them",
            "FILE_KIND_UNKNOWN",
        )
    return _without_gaps(folder, next(iter(sequences.values())))


def _add(found: dict[int, Path], number: int, path: Path) -> None:
    """Add the image of a frame; refuse a second one, such as f.7.png beside f.0007.png."""
    if number in found:
        raise InputError(
            f"{found[number]} and {path.name} are both frame {number}; keep one of them",
            "NAME_REPEATED",
        )
    found[number] = path


def _names(folder: Path) -> list[str]:
    try:
        with os.scandir(folder) as entries:
            names = []
            for entry in entries:
                names.append(entry.name)
                if len(names) > _ENTRIES:
                    raise InputError(
                        f"{folder} has more than {_ENTRIES} entries; "
                        "move the images to a folder of their own",
                        "TOO_LARGE",
                    )
            return sorted(names)
    except OSError as error:
        raise InputError(f"{folder} cannot be read: {error.strerror}", "FILE_UNREADABLE") from error


def _without_gaps(path: Path, found: dict[int, Path]) -> tuple[ImageFile, ...]:
    first, last = min(found), max(found)
    count = last - first + 1
    if count > _MOST or count > _SPARSE * len(found) + 1000:
        raise InputError(
            f"{path}: the {len(found)} images are numbered {first} to {last}; expected the frames "
            "of one sequence, one after the other",
            "TOO_LARGE",
        )
    return tuple(ImageFile(n, found.get(n)) for n in range(first, last + 1))
