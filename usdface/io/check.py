"""Blend-shape checks of any file, beyond those of the standard validators."""

from pathlib import Path

from usdface.errors import InputError
from usdface.findings import Finding

__all__ = ["check_file"]

_GLTF = (".glb", ".gltf", ".vrm")
_USD = (".usd", ".usda", ".usdc", ".usdz")


def check_file(path: Path) -> list[Finding]:
    """Check the blend shapes, names and weights of a file.

    The rules are `usdface.io.usd.check` and `usdface.io.gltf.check`, which also define the
    severities.

    Raises
    ------
    InputError
        If the file is neither USD nor glTF or cannot be read.
    """
    kind = path.suffix.lower()
    if not path.is_file():
        raise InputError(f"no such file: {path}", "FILE_UNREADABLE")
    if kind in _USD:
        from usdface.io.usd.check import check_usd  # each format's libraries only when needed

        return check_usd(path)
    if kind in _GLTF:
        from usdface.io.gltf.check import check_gltf

        try:
            return check_gltf(path)
        except InputError as error:
            raise InputError(f"{path}: {error}", error.code) from error
    known = ", ".join((*_USD, *_GLTF))
    raise InputError(f"{path} cannot be checked; expected one of {known}")
