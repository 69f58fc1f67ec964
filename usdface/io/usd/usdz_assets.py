"""The files that a package brings along: textures and sounds of the scene, by the folder rule.

Source: OpenUSD, "Usdz File Format Specification" (file types, package-relative paths).
"""

import re
from collections import defaultdict
from pathlib import Path

from pxr import Ar, Sdf, Usd, UsdUtils

from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.io.asset_folder import OUTSIDE, is_inside
from usdface.io.udim import is_udim, udim_tiles
from usdface.io.usd.assets import folders_of, outer_file, read_asset
from usdface.io.usd.held_layers import hold_specs
from usdface.materials import Texture

__all__ = ["localise"]

_LAYERS = (".usd", ".usda", ".usdc", ".usdz")
_TYPES = (".png", ".jpg", ".jpeg", ".exr", ".avif", ".m4a", ".mp3", ".wav")


def localise(
    flat: Sdf.Layer, stage: Usd.Stage, asset_root: Path | None
) -> tuple[dict[str, bytes], list[Finding]]:
    """Let a flattened layer name the files of its package, and return these by name.

    A file is packed if it lies in the folder of a layer of `stage` that names it, in that of
    the root layer, or in `asset_root`. Others are no longer named; nor are layers, which are
    in the flattened one.

    Parameters
    ----------
    flat : Sdf.Layer
        The flattened `stage`; it is changed.
    stage : Usd.Stage
    asset_root : Path, optional

    Returns
    -------
    dict of bytes by str
    list of Finding
        ASSET_OUTSIDE; TEXTURE_MISSING for a missing or unreadable file; FEATURE_DROPPED
        for types of files that USDZ does not hold.
    """
    named: list[str] = []

    def collect(asset: str) -> str:
        named.append(asset)
        return asset

    UsdUtils.ModifyAssetPaths(flat, collect)
    allowed = _allowed(stage)
    general = [*folders_of(stage.GetRootLayer())[:1], asset_root]
    files: dict[str, bytes] = {}
    places: dict[str, str] = {}
    findings: list[Finding] = []
    for asset in sorted(set(named)):
        if Path(_name(asset)).suffix.lower() in _LAYERS:
            continue
        try:
            held = _read(asset, [*allowed[asset], *general])
        except InputError as error:
            code = _CODES.get(error.code, "TEXTURE_MISSING")
            findings.append(finding(code, asset, "{error}; it is left out", error, feature="asset"))
            continue
        # A folder for each, as two may have one name.
        place = f"{len(places)}/" + re.sub(r"[^\w.<>-]", "_", _name(asset), flags=re.ASCII)
        places[asset] = place
        files |= {place.replace("<UDIM>", tile): data for tile, data in held.items()}
    UsdUtils.ModifyAssetPaths(flat, lambda asset: places.get(asset, ""))
    return files, findings


_CODES = {"URI_OUTSIDE": "ASSET_OUTSIDE", "FILE_KIND_UNKNOWN": "FEATURE_DROPPED"}


def _name(asset: str) -> str:
    """Return the name of a file, the innermost one where it is in a package."""
    return Path(Ar.SplitPackageRelativePathInner(asset)[1] or asset).name


def _allowed(stage: Usd.Stage) -> dict[str, list[Path]]:
    """Return the folders that each asset may come from, by its path as in a flattened layer."""
    allowed: dict[str, list[Path]] = defaultdict(list)
    for layer in stage.GetUsedLayers():
        if layer.realPath:
            assets = UsdUtils.ExtractExternalReferences(layer.realPath)[1]
            hold_specs(layer)
            for asset in assets:
                absolute = Sdf.ComputeAssetPathRelativeToLayer(layer, asset)
                allowed[absolute] += folders_of(layer)
    return allowed


def _read(asset: str, folders: list[Path | None]) -> dict[str, bytes]:
    """Return the bytes of a file, or of each tile of a UDIM, by tile number ("" for a file)."""
    outer = outer_file(asset)
    inside = Ar.IsPackageRelativePath(asset)
    tiled = is_udim(outer) and not inside
    tiles = udim_tiles(Texture(str(outer))) if tiled else {}
    files = {str(number): tile.path for number, tile in tiles.items()} if tiled else {"": asset}
    # References that the flattening could not find stay as they were written.
    if not files or not outer.is_absolute():
        raise InputError(f"{asset} does not exist", "FILE_UNREADABLE")
    if not all(is_inside(outer_file(file), folders) for file in files.values()):
        raise InputError(f"{asset} {OUTSIDE}", "URI_OUTSIDE")
    if Path(_name(asset)).suffix.lower() not in _TYPES:
        held = ", ".join(_TYPES)
        raise InputError(
            f"{asset} is of no type that USDZ holds ({held}); convert it", "FILE_KIND_UNKNOWN"
        )
    return {tile: read_asset(file) for tile, file in files.items()}
