"""A USD scene as one `.usdz` package."""

from pathlib import Path

from pxr import Sdf, Tf, Usd, UsdUtils

from usdface.errors import OutputError
from usdface.findings import Finding
from usdface.io.atomic import atomic_path
from usdface.io.usd.stage import open_stage

__all__ = ["write_usdz"]


def write_usdz(source: Path, path: Path) -> list[Finding]:
    """Flatten a scene into one binary layer and pack it with its textures.

    AR viewers read only the package's first layer, and only if it is binary; so what the
    layers of a shot compose to is written, not the layers. The weights animation, and with it
    the corrector's effect, is what plays there; layers to mute are left behind.

    Raises
    ------
    InputError
        If the scene cannot be opened.
    OutputError
        If the package cannot be written.

    References
    ----------
    OpenUSD, "Usdz File Format Specification".
    """
    stage = open_stage(source)
    with atomic_path(path) as temporary:
        flat = temporary.with_name(f".{path.stem}.usdc")
        try:
            done = _flatten(stage, flat) and UsdUtils.CreateNewUsdzPackage(
                Sdf.AssetPath(str(flat)), str(temporary), f"{path.stem}.usdc"
            )
        except Tf.ErrorException as error:
            raise OutputError(f"cannot write {path}: {str(error).splitlines()[-1]}") from error
        finally:
            flat.unlink(missing_ok=True)
        if not done:
            raise OutputError(f"cannot write {path}: USD could not pack {source}")
    return []


def _flatten(stage: Usd.Stage, path: Path) -> bool:
    # Flattening makes asset paths absolute, which the packer then gathers.
    return bool(stage.Flatten(addSourceFileComment=False).Export(str(path)))
