"""Any rig source as a `Rig`: the one place that knows which reader reads what."""

from collections.abc import Sequence
from pathlib import Path

from usdface.clips import Clip
from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.io.asset_folder import asset_folder
from usdface.io.rigs.combinations import combinations_file, with_combinations_of
from usdface.io.rigs.makehuman import is_makehuman, makehuman_files, read_makehuman
from usdface.io.rigs.shape_folder import mesh_files, read_shape_folder
from usdface.io.usd.clips import clips_of_stage
from usdface.io.usd.rig import read_rig
from usdface.io.usd.stage import open_stage
from usdface.options import RigOptions
from usdface.rigs import Rig

__all__ = ["folder_files", "read_rig_file"]

_GLTF = (".glb", ".gltf")
_USD = (".usd", ".usda", ".usdc", ".usdz")


def read_rig_file(path: Path, options: RigOptions | None = None) -> tuple[Rig, list[Finding]]:
    """Read a glTF or USD file, a folder of meshes, or a MakeHuman folder.

    Raises
    ------
    InputError
        If it is none of these, cannot be read, or has no blend shapes.
    """
    options = options or RigOptions()
    root, kind = asset_folder(options.asset_root), path.suffix.lower()
    if path.is_dir():
        if is_makehuman(path):
            rig, findings = read_makehuman(path)
        else:
            rig, findings = read_shape_folder(path, options)
        rig, notes = with_combinations_of(path, rig)
        findings += notes
    elif not path.exists():
        raise InputError(f"no such file or folder: {path}", "FILE_UNREADABLE")
    elif kind in _GLTF:
        from usdface.io.gltf.read import read_gltf  # loads glTF's libraries only here

        rig, clips, findings = read_gltf(path, root)
        findings += _dropped(clips)
    elif kind in _USD:
        rig, findings = read_rig(path, root)
        findings += _dropped_of_stage(path, rig)
    else:
        known = ", ".join((*_GLTF, *_USD))
        raise InputError(
            f"{path} is not a rig that usdface reads; use a folder or {known}", "FILE_KIND_UNKNOWN"
        )
    if not rig.shape_names:
        raise InputError(f"{path} has no blend shapes; a rig needs at least one", "SHAPES_MISSING")
    return rig, findings


def folder_files(folder: Path) -> list[Path]:
    """Return the files of a folder that reading it as a rig reads."""
    meshes = makehuman_files(folder) if is_makehuman(folder) else mesh_files(folder)
    combinations = combinations_file(folder)
    return [*meshes, *([combinations] if combinations.is_file() else [])]


def _dropped_of_stage(path: Path, rig: Rig) -> list[Finding]:
    try:
        return _dropped(clips_of_stage(open_stage(path), rig)[0])
    except InputError as error:  # it is left out anyhow
        return [finding("ANIMATION_DROPPED", "", f"left out, as it cannot be read: {error}")]


def _dropped(clips: Sequence[Clip]) -> list[Finding]:
    message = "a rig stands still; `usdface import` and `export` keep animations"
    return [finding("ANIMATION_DROPPED", clip.name, message) for clip in clips if not clip.still]
