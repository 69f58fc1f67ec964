"""Files that a command reads, none of which it overwrites.

The one place that knows which files a source brings in, and that compares them with the outputs: by
the file itself, so that links, relative names and other spellings do not matter.
"""

from collections.abc import Callable, Collection, Iterable, Mapping
from itertools import chain
from pathlib import Path

from usdface.errors import OutputError
from usdface.io.atomic import check_place
from usdface.io.images.sequence import find_images, is_pattern, may_be_images
from usdface.io.staging import finish_dead_runs
from usdface.io.usd_names import unusable_part

__all__ = ["among", "check_outputs", "files_read", "files_written", "first_free"]

_USD = (".usd", ".usda", ".usdc")


def files_read(
    *sources: Path | None, labels: Path | None = None, apart: Collection[Path] = ()
) -> dict[Path, Path]:
    """Return every file that reading `sources` reads, and of which of them it is a part.

    Parameters
    ----------
    *sources : Path or None
        Files and folders as they are given to a command: USD with all that it is composed of (in
        every variant) and all assets it names, glTF with its buffers and images, folders of
        meshes, anything else alone. None is no source.
    labels : Path, optional
        Labels; the takes that they name are read, too.
    apart : collection of Path
        Direct sublayers of USD sources that do not count: results of an earlier run.

    Raises
    ------
    InputError
        If the labels cannot be read. Readers report faults of other sources.
    """
    given = dict.fromkeys(source for source in sources if source is not None)
    if labels is not None:
        from usdface.io.labels_file import read_labels

        given |= dict.fromkeys([labels, *(label.take for label in read_labels(labels))])
    return {file: source for source in given for file in _files_of(source, apart)}


def files_written(output: Path, read: Iterable[Path]) -> tuple[Path, ...]:
    """Return the files of a result that is written, itself first, without those that were read."""
    textures = output.with_name(f"{output.stem}_textures")
    if output.suffix.lower() != ".gltf" and not textures.is_dir():
        return (output,)  # a stage is not opened for nothing
    known, folder = among(read), output.parent.resolve()
    beside = [place.resolve() for place in _files_of(output)[1:]]
    named = [
        output.parent / place.relative_to(folder) if place.is_relative_to(folder) else place
        for place in beside
    ]
    return (output, *(place for place in named if not known(place)))


def check_outputs(places: Iterable[Path | None], read: Mapping[Path, Path]) -> None:
    """Fail early if an output cannot, or must not, be written.

    Parameters
    ----------
    places : iterable of Path or None
        Outputs; None is none. To a .gltf belongs its .bin. Its textures go where there is room.
    read : mapping of Path to Path
        From `files_read`.

    Raises
    ------
    OutputError
        If an output is one of the files that are read, two are one file, one is a folder, a
        folder cannot be written to, or USD could not open the result by its name.
    """
    readers = {_identity(file): source for file, source in read.items()}
    taken: dict[object, Path] = {}
    for place in chain.from_iterable(_with_binary(place) for place in places if place):
        identity = _identity(place)
        source = readers.get(identity) if identity else None
        if source is not None:
            same = _identity(source) == identity
            reason = "is an input" if same else f"is read by {source}"
            raise OutputError(f"{place} {reason} and would be overwritten; choose another place")
        check_place(place)
        _check_name(place)
        finish_dead_runs(place.parent)
        other = taken.setdefault(identity or place.resolve(), place)
        if other is not place:
            raise OutputError(
                f"{place} would be overwritten: it is the same file as the output {other}; choose "
                "a place for each"
            )


def among(files: Iterable[Path]) -> Callable[[Path], bool]:
    """Return a test whether a path is one of `files`, by whatever name."""
    known = {_identity(file) for file in files} - {None}
    return lambda path: _identity(path) in known


def first_free(
    folder: Path, names: Iterable[str], data: bytes, taken: Callable[[Path], bool]
) -> tuple[str, bool]:
    """Return the first of endless `names` in a folder that may hold `data`, and whether it does.

    A file that is `taken` is not written over; if it has the same bytes, it need not be.
    """
    for name in names:
        place = folder / name
        if not taken(place):
            return name, False
        if place.read_bytes() == data:
            return name, True
    raise OutputError(f"cannot write to {folder}: no name is free")


def _identity(path: Path) -> tuple[int, int] | None:
    """Return which file a path leads to, as `os.path.samefile` compares; None for none."""
    try:
        status = path.stat()
    except (OSError, ValueError):  # ValueError: a name that no file can have
        return None
    return status.st_dev, status.st_ino


def _check_name(place: Path) -> None:
    """Refuse a name for USD under which it would write the file, and then not open it."""
    fault = unusable_part(place)
    try:
        str(place.absolute()).encode()
    except UnicodeEncodeError:
        fault = "the name is not UTF-8, as USD wants it; choose another"
    if not fault:
        return
    from usdface.io.usd.stage import is_usd  # loads USD only here

    if is_usd(place):
        raise OutputError(f"cannot write {place}: {fault}")


def _with_binary(place: Path) -> tuple[Path, ...]:
    return (place, place.with_suffix(".bin")) if place.suffix.lower() == ".gltf" else (place,)


def _files_of(path: Path, apart: Collection[Path] = ()) -> list[Path]:
    """Return a file, or the files of a folder, with all that reading it reads."""
    if is_pattern(path):
        return [each.path for each in find_images(path) if each.path is not None]
    if path.is_dir():
        from usdface.io.rigs.files import folder_files  # loads trimesh only here

        if files := folder_files(path):
            return files
        # A folder that is no rig is one of data, of which anything may be read; of a film only the
        # images are: the take may be written beside them, again and again.
        film = may_be_images(path)
        files = [file for file in path.rglob("*") if file.is_file()]
        return [file for file in files if not (film and file.suffix.lower() in _USD)]
    from usdface.io.gltf.external_files import external_files, may_be_gltf

    if may_be_gltf(path):
        return [path, *external_files(path)]
    from usdface.io.usd.dependencies import dependencies
    from usdface.io.usd.stage import is_usd

    return [path, *dependencies(path, apart)] if is_usd(path) else [path]
