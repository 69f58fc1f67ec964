"""Blend-shape checks of any file, beyond those of the standard validators."""

from pathlib import Path

from usdface.errors import InputError, UsdFaceError, errors_at
from usdface.face.expression_poses import units_of
from usdface.face.head_size import report_size
from usdface.findings import Finding, finding

__all__ = ["check_file"]

_GLTF = (".glb", ".gltf", ".vrm")
_USD = (".usd", ".usda", ".usdc", ".usdz")


_FACE = 3  # known names of blend shapes that make a face of a file


def check_file(path: Path) -> list[Finding]:
    """Check the blend shapes, names and weights of a file, and the size of a face.

    The rules are `usdface.io.usd.check` and `usdface.io.gltf.check`, which also define the
    severities.

    Raises
    ------
    InputError
        If the file is neither USD nor glTF or cannot be read.
    """
    kind = path.suffix.lower()
    if path.is_dir():
        raise InputError(
            f"{path} is a folder; name its USD or glTF files; of a folder of OBJ, PLY or MakeHuman "
            "targets `usdface rig` makes one to check",
            "FILE_UNREADABLE",
        )
    if not path.is_file():
        raise InputError(f"no such file: {path}", "FILE_UNREADABLE")
    if kind in _USD:
        from usdface.io.usd.check import check_usd  # each format's libraries only when needed

        return check_usd(path) + _face_of(path)
    if kind in _GLTF:
        from usdface.io.gltf.check import check_gltf

        with errors_at(path):
            return check_gltf(path) + _face_of(path)
    known = ", ".join((*_USD, *_GLTF))
    raise InputError(
        f"{path} cannot be checked; expected one of {known}; `usdface rig` makes one of the folder "
        "of an OBJ or PLY"
        if kind in (".obj", ".ply")
        else f"{path} cannot be checked; expected one of {known}"
    )


def _face_of(path: Path) -> list[Finding]:
    """Return RIG_SIZE_UNUSUAL where blend shapes have names of a face, but not its size.

    SHAPES_ABSENT where there are none: no finding would look like a sound face.
    """
    from usdface.io.rigs.files import read_rig_file

    try:
        rig, _ = read_rig_file(path)
    except UsdFaceError as error:
        absent = error.code in ("FACE_MISSING", "SHAPES_MISSING")
        # An unreadable file was reported.
        return [finding("SHAPES_ABSENT", str(path))] if absent else []
    return report_size(rig) if len(units_of(rig.shape_names)) >= _FACE else []
