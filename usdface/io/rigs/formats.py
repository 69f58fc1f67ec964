"""The rig formats of usdface; loads no library, so that help texts can list them."""

from pathlib import Path

from usdface.formats import RigReader
from usdface.io.format_table import FormatTable
from usdface.lazy import lazy_function

__all__ = ["RIG_READERS", "is_makehuman_folder", "mesh_files"]

_MESHES = (".obj", ".ply")


def mesh_files(folder: Path) -> list[Path]:
    """Return the OBJ and PLY files of a folder, sorted by name; hidden ones are of the system."""
    meshes = (p for p in folder.iterdir() if p.suffix.lower() in _MESHES and p.is_file())
    return sorted(p for p in meshes if not p.name.startswith("."))


def is_makehuman_folder(folder: Path) -> bool:
    """Return whether a folder has MakeHuman targets, and is no folder of shapes."""
    from usdface.io.rigs.makehuman import is_makehuman

    return is_makehuman(folder)


def _is_shape_folder(folder: Path) -> bool:
    """Return whether a folder has meshes and is none of MakeHuman's."""
    return bool(mesh_files(folder)) and not is_makehuman_folder(folder)


RIG_READERS = FormatTable(
    RigReader,
    "usdface.rigs",
    ("rigs", "read"),
    (
        RigReader(
            name="glTF",
            suffixes=(".glb", ".gltf", ".vrm"),
            options=("asset_root",),
            read=lazy_function("usdface.io.rigs.scene_rig", "read_gltf_rig"),
        ),
        RigReader(
            name="USD",
            suffixes=(".usd", ".usda", ".usdc", ".usdz"),
            options=("asset_root",),
            read=lazy_function("usdface.io.rigs.scene_rig", "read_usd_rig"),
        ),
        RigReader(
            name="folder of OBJ or PLY",
            folder=True,
            sniff=_is_shape_folder,
            options=("meters_per_unit", "up_axis", "neutral"),
            read=lazy_function("usdface.io.rigs.shape_folder", "read_shape_folder"),
        ),
        RigReader(
            name="folder of MakeHuman targets",
            folder=True,
            sniff=is_makehuman_folder,
            options=("meters_per_unit", "neutral"),
            read=lazy_function("usdface.io.rigs.makehuman", "read_makehuman"),
        ),
    ),
    remedies={
        **dict.fromkeys((".obj", ".ply"), "name the folder: a file is the neutral face or a shape"),
        ".target": "name the folder of the targets, with base.obj beside or above them",
        **dict.fromkeys((".c3d", ".trc", ".bvh", ".csv"), "`usdface take` reads a recording"),
        **dict.fromkeys((".fbx", ".blend", ".ma", ".mb"), "export the character as glTF or USD"),
    },
)
