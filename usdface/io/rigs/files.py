"""Rigs from files and folders, each by the reader of its format."""

from pathlib import Path

from usdface.errors import InputError
from usdface.findings import Finding
from usdface.io.rigs.combinations import combinations_file, read_combinations
from usdface.io.rigs.formats import RIG_READERS, is_makehuman_folder, mesh_files
from usdface.io.rigs.verify_rig import verified_rig
from usdface.options import RigOptions
from usdface.rigs import Rig

__all__ = ["folder_files", "read_rig_file"]


def read_rig_file(path: Path, options: RigOptions | None = None) -> tuple[Rig, list[Finding]]:
    """Read a rig: glTF, USD, a folder of meshes, MakeHuman, or a format of another package.

    Raises
    ------
    InputError
        If it is not one of these, cannot be read, has no blend shapes, or its format does not
        follow one of the `options`.
    PluginError
        If the reader of another package fails, or returns something else than a rig.
    """
    options = options or RigOptions()
    if not path.exists():
        raise InputError(f"no such file or folder: {path}", "FILE_UNREADABLE")
    reader, findings = RIG_READERS.find(path)
    reader.format.check_options(path, options)
    result = reader.call(reader.format.read, path, options)
    rig, found = verified_rig(reader, result) if reader.origin else result
    findings += found
    if path.is_dir():
        rig, found = read_combinations(path, rig)
        findings += found
    if not rig.shape_names:
        raise InputError(_without_shapes(path), "SHAPES_MISSING")
    return rig, findings


def _without_shapes(path: Path) -> str:
    """Return the message for a rig that has no blend shape."""
    message = f"{path} has no blend shapes; a rig needs at least one"
    if not path.is_dir():
        return message
    from usdface.io.rigs.makehuman import target_files

    targets = target_files(path)[1]
    if targets:
        return f"{message}: its {len(targets)} MakeHuman .target files need their mesh as base.obj"
    return f"{message}: beside the neutral mesh a file for each shape, or MakeHuman's .target files"


def folder_files(folder: Path) -> list[Path]:
    """Return the files of a folder that reading it as a rig reads."""
    if is_makehuman_folder(folder):
        from usdface.io.rigs.makehuman import makehuman_files

        meshes = makehuman_files(folder)
    else:
        meshes = mesh_files(folder)
    combinations = combinations_file(folder)
    return [*meshes, *([combinations] if combinations.is_file() else [])]
