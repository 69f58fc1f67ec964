"""Layers written to files: all of them or none, and reloaded where they are open."""

import os
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from pxr import Sdf, Tf, UsdUtils

from usdface.errors import OutputError
from usdface.io.atomic import all_or_none, atomic_path, staged_files, when_written, write_bridge
from usdface.io.relative_path import relative_path
from usdface.io.usd.errors import usd_message
from usdface.io.usd.held_layers import hold_specs
from usdface.io.usd_names import unusable_part

__all__ = ["check_usd_name", "relative_asset", "save_layer", "save_layers"]


def relative_asset(target: Path, owner: Path) -> str:
    """Return `target` as an asset path that the layer at `owner` can name, relative to it.

    Raises
    ------
    OutputError
        If USD would not find it.
    """
    for path in (target, owner):
        if fault := unusable_part(path):
            raise OutputError(f"a USD file cannot refer to {target}: {fault}")
    relative = relative_path(target.resolve(), owner.resolve().parent)
    plain = relative.startswith("..") or Path(relative).is_absolute()
    return relative if plain else f"./{relative}"


def check_usd_name(path: Path) -> None:
    """Refuse to write USD under another name, before any work.

    Raises
    ------
    OutputError
        If it does not end in .usda, .usdc or .usd.
    """
    if path.suffix not in (".usda", ".usdc", ".usd"):
        raise OutputError(f"{path} is no USD file name; end it in .usda, .usdc or .usd")


def save_layer(layer: Sdf.Layer, path: Path, *, names_files: bool = True) -> None:
    """Write a layer to `path` atomically; `.usda`, `.usdc` and `.usd` give the format.

    A layer that is known to name no other files is not searched for them, which takes as much
    memory again.

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    save_layers([(path, layer)], names_files=names_files)


def save_layers(layers: Sequence[tuple[Path, Sdf.Layer]], *, names_files: bool = True) -> None:
    """Write several layers, all of them or none; layers that are open are reloaded.

    Raises
    ------
    OutputError
        If one cannot be written; then none is replaced.
    """
    for path, _ in layers:
        check_usd_name(path)
    with all_or_none():
        for path, layer in layers:
            bridge = _bridge(layer, path) if names_files else None
            with atomic_path(path) as temporary:
                _export(layer, temporary, path)
            hold_specs(layer)
            if bridge is not None:
                with write_bridge(path) as temporary:
                    _export(bridge, temporary, path)
            when_written(partial(_reload, path))


def _export(layer: Sdf.Layer, temporary: Path, path: Path) -> None:
    try:
        done = layer.Export(str(temporary))
    except Tf.ErrorException as error:
        raise OutputError(f"cannot write {path}: {usd_message(error)}") from error
    if not done:
        raise OutputError(f"cannot write {path}")


def _bridge(layer: Sdf.Layer, path: Path) -> Sdf.Layer | None:
    """Return the layer with files that are staged named where they lie; None if it names none."""
    folder = path.resolve().parent
    places = {place.parent.resolve() / place.name: f for place, f in staged_files().items()}
    found = False

    def where(asset: str) -> str:
        nonlocal found
        file = places.get(Path(os.path.normpath(folder / asset))) if asset else None
        found = found or file is not None
        return asset if file is None else relative_asset(file, path)

    if not places:
        return None
    bridge = Sdf.Layer.CreateAnonymous(".usda")
    bridge.TransferContent(layer)
    UsdUtils.ModifyAssetPaths(bridge, where)
    hold_specs(bridge)
    return bridge if found else None


def _reload(path: Path) -> None:
    opened = Sdf.Layer.Find(str(path.resolve()))
    if opened:
        opened.Reload(force=True)
