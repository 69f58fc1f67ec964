"""The files that a USD file brings in: layers, in every variant, and the assets that they name."""

from collections.abc import Collection, Iterator
from pathlib import Path

from pxr import Ar, Sdf, Tf, UsdShade, UsdUtils

from usdface.errors import InputError
from usdface.io.usd.held_layers import hold_specs
from usdface.io.usd.sandbox import RefusedError
from usdface.io.usd.stage import is_usd, open_stage

__all__ = ["dependencies"]


def dependencies(path: Path, apart: Collection[Path] = ()) -> list[Path]:
    """Return the files that a stage is, or may be, composed of, and assets such as textures.

    Sublayers, references and payloads are followed in every variant, be it chosen or not, as are
    value clips, in layers of their own or by a template; a texture of tiles (UDIM) is all of its
    tiles. Files in a package (USDZ) count as the package. Files that are not there are left out,
    and a layer that cannot be read leads no further.

    Parameters
    ----------
    path : Path
    apart : collection of Path
        Direct sublayers of `path` that do not count, unless another layer names them, too.

    Returns
    -------
    list of Path
        Absolute, without `path`; each once, in an order that the files alone determine.
    """
    left_out = {layer.resolve() for layer in apart}
    delegate = UsdUtils.CoalescingDiagnosticDelegate()  # no word of USD's on standard error
    try:
        # Only the composed stage knows layers named by variables that a stronger one sets.
        stage = open_stage(path, without=apart)
        used = sorted(layer.realPath for layer in stage.GetUsedLayers() if layer.realPath)
    except RefusedError:
        return []
    except InputError:
        stage, used = None, []
    root = path.resolve()
    waiting, found = [str(root), *used], dict.fromkeys((str(root), *used))
    while waiting:
        layer = waiting.pop(0)
        skipped = left_out if Path(layer) == root else set()
        for name in _named_by(layer, skipped):
            if name not in found:
                found[name] = None
                waiting.append(name)
    del delegate, stage  # which held the layers open until they were looked at
    files = dict.fromkeys(Path(Ar.SplitPackageRelativePathOuter(name)[0]) for name in found)
    return [file for file in files if file != root and file.is_file()]


def _named_by(name: str, skipped: Collection[Path]) -> Iterator[str]:
    """Yield the files that the layer `name` names, resolved; none if it is no readable layer.

    `skipped` are sublayers that do not count.
    """
    if not Path(name).is_file() or not is_usd(Path(name)):
        return
    try:
        layer = Sdf.Layer.FindOrOpen(name)
        sublayers, references, payloads = UsdUtils.ExtractExternalReferences(name)
    except (Tf.ErrorException, UnicodeError):
        return
    if not layer:
        return
    hold_specs(layer)
    for asset in (*sublayers, *references, *payloads):
        try:
            if "<UDIM>" in asset:
                tiles = UsdShade.UdimUtils.ResolveUdimTilePaths(asset, layer)
                yield from (str(Path(tile).resolve()) for tile, _ in tiles)
                continue
            place = Sdf.ComputeAssetPathRelativeToLayer(layer, asset)
            resolved = str(Ar.GetResolver().Resolve(place))
        except (Tf.ErrorException, UnicodeError):
            continue
        if resolved:
            outer, inner = Ar.SplitPackageRelativePathOuter(resolved)
            file = Path(outer).resolve()
            if file not in skipped or asset not in sublayers:
                yield Ar.JoinPackageRelativePath(str(file), inner) if inner else str(file)
