"""A film as frames that are read one at a time: image files, the images of a GIF, a movie."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from importlib.util import find_spec
from itertools import islice
from pathlib import Path

import numpy as np

from usdface.errors import InputError, how_to_install
from usdface.footage.colour_channel import Pixels
from usdface.footage.scan import LoadFrame
from usdface.io.images.image_header import ImageHeader, read_header
from usdface.io.images.movie import movie_frames, read_movie_header
from usdface.io.images.read_image import ReadSubimage, exposure_of, open_image, read_image
from usdface.io.images.sequence import MOVIE_SUFFIXES, ImageFile, find_images

__all__ = ["Film", "open_film"]

_FILMS = (".gif", ".webp", ".tif", ".tiff")  # whose images are one after the other in time
_MEASURED = 9  # images whose exposure is measured: a few bright or black ones decide nothing


@dataclass(slots=True)
class Film:
    """A film; `unreadable` fills while its frames are read.

    Attributes
    ----------
    path : Path
    header : ImageHeader
        Of the first image whose header can be read.
    header_frame : int
        Index of that image.
    files : tuple of ImageFile
        Empty for a movie.
    exposure : float
        Factor on linear light.
    unreadable : dict of int to str
        Frame index -> reason.
    ignored_parts : int
        Images beside the first one in an image file that is no film, as layers and views.
    times : list of float [s]
        Of a movie: the time of each frame that was read.
    """

    path: Path
    header: ImageHeader
    files: tuple[ImageFile, ...] = ()
    exposure: float = 1.0
    ignored_parts: int = 0
    header_frame: int = 0
    unreadable: dict[int, str] = field(default_factory=dict)
    times: list[float] = field(default_factory=list)

    @property
    def timecode(self) -> str:
        """SMPTE time code of the first frame; "" = not known."""
        return self.header.timecode if self.header_frame == 0 else ""

    @property
    def length(self) -> int:
        """Number of frames; 0 of a movie, where it is known when all are read."""
        return max(self.header.subimages, len(self.files)) if self.files else 0

    @property
    def missing(self) -> list[int]:
        """Indices of the frames that have no file."""
        return [index for index, file in enumerate(self.files) if file.path is None]

    def loads(self) -> Iterator[LoadFrame]:
        """Yield a function for each frame, which reads it when called."""
        if not self.files:
            self.times.clear()
            for time, pixels in movie_frames(self.path, self.header.size):
                self.times.append(time)
                yield partial(_given, pixels)
        elif self.header.subimages > 1:
            path = self.files[0].path
            assert path is not None
            with open_image(path) as read:
                for index in range(self.header.subimages):
                    yield partial(_given, self._read(index, read))
        else:
            for index in range(len(self.files)):
                yield partial(self._read, index)

    def samples(self, count: int) -> Iterator[Pixels]:
        """Yield some frames, spread over the film, one at a time; those that can be read.

        Of a movie, whose length is known at its end, one a second from the first on.
        """
        if not self.files:
            step = max(1, round(self.header.rate or 30.0))
            frames = islice(movie_frames(self.path, self.header.size), 0, count * step, step)
            yield from (pixels for _, pixels in frames)
            return
        last = self.length - 1
        for index in sorted({round(k * last / max(count - 1, 1)) for k in range(count)}):
            pixels = self._read(index)
            if pixels is not None:
                yield pixels

    def frame(self, wanted: int) -> Pixels | None:
        """Return one frame; None where there is none."""
        if self.files:
            return self._read(wanted)
        for index, (_, pixels) in enumerate(movie_frames(self.path, self.header.size)):
            if index == wanted:
                return pixels
        return None

    def _read(self, index: int, read: ReadSubimage | None = None) -> Pixels | None:
        many = self.header.subimages > 1
        path = self.files[0 if many else index].path
        if path is None:
            return None
        try:
            read = read or partial(read_image, path)
            pixels = read(index if many else 0, self.exposure)
        except InputError as error:
            self.unreadable[index] = str(error)
            return None
        size = pixels.shape[1], pixels.shape[0]
        if size != self.header.size:
            raise InputError(
                f"{path} has {size[0]} x {size[1]} pixels; expected {self.header.size[0]} x "
                f"{self.header.size[1]} as in the images before it; give one sequence",
                "VALUES_WRONG",
            )
        return pixels


def _exposure(files: Sequence[ImageFile]) -> float:
    """Return the usual factor on linear light: the first image may be a slate, or fade in."""
    paths = [file.path for file in files if file.path is not None]
    spread = np.linspace(0, len(paths) - 1, min(_MEASURED, len(paths))).round().astype(int)
    factors = []
    for index in spread.tolist():
        try:
            factors.append(exposure_of(paths[index]))
        except InputError:
            continue  # it is reported where its dots are searched
    return float(np.median(factors or [1.0]))


def _given(pixels: Pixels | None) -> Pixels | None:
    return pixels


def open_film(path: Path) -> Film:
    """Find the images of a film and read the header of the first that can be read.

    Raises
    ------
    InputError
        If there are none, or a movie cannot be read here.
    """
    if path.suffix.lower() in MOVIE_SUFFIXES:
        if not path.is_file():
            raise InputError(f"no such file: {path}", "FILE_UNREADABLE")
        if find_spec("av") is None:
            raise InputError(
                f"{path}: movies need PyAV: {how_to_install('movies')}; or make images: "
                f"ffmpeg -i {path.name} frames.%05d.png",
                "FILE_KIND_UNKNOWN",
            )
        return Film(path, read_movie_header(path))
    files = find_images(path)
    reason: InputError | None = None
    for index, file in enumerate(files[:1000]):
        if file.path is None:
            continue
        try:
            header = read_header(file.path)
        except InputError as error:
            reason = reason or error
            continue
        parts = header.subimages
        if len(files) > 1 or file.path.suffix.lower() not in _FILMS:
            header = replace(header, subimages=1)
        ignored = parts - header.subimages
        exposure = _exposure(files[index:] if header.subimages == 1 else (file,))
        return Film(path, header, files, exposure, ignored_parts=ignored, header_frame=index)
    raise reason or InputError(
        f"{path} has no image; expected PNG, JPEG, EXR, TIFF or DPX files", "FILE_UNREADABLE"
    )
