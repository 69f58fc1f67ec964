"""The paths of a shot's result: its root layer, and the layers below it."""

from dataclasses import dataclass
from pathlib import Path

from usdface.errors import InputError

__all__ = ["LayerPaths", "layer_paths"]


@dataclass(frozen=True, slots=True)
class LayerPaths:
    """The files of a result; the folder of the layers may hold other files about the result."""

    root: Path
    solve: Path
    express: Path
    closure: Path

    @property
    def layers(self) -> tuple[Path, ...]:
        """All but the root, the weakest first."""
        return (self.solve, self.express, self.closure)

    @property
    def folder(self) -> Path:
        """The folder of the layers."""
        return self.solve.parent


def layer_paths(shot: Path, root: Path | None = None) -> LayerPaths:
    """Return the paths of a shot's layers: beside it, or beside another `root`.

    Raises
    ------
    InputError
        If the root is not named as a USD file.
    """
    root = root or shot.parent / f"{shot.stem}.usdface.usda"
    if root.suffix not in (".usda", ".usdc", ".usd"):
        raise InputError(
            f"{root} is not named as a USD file; end it in .usda, .usdc or .usd",
            "FILE_KIND_UNKNOWN",
        )
    stem = root.stem if root.stem.endswith(".usdface") else f"{root.stem}.usdface"
    folder = root.with_name(stem)
    return LayerPaths(root, folder / "solve.usdc", folder / "express.usdc", folder / "closure.usdc")
