"""Stages and layers opened; their faults are one clear line."""

from collections.abc import Collection
from pathlib import Path

import numpy as np
from pxr import Sdf, Usd

from usdface.errors import InputError
from usdface.io.staging import finish_dead_runs
from usdface.io.usd.errors import one_line, usd_errors
from usdface.io.usd.held_layers import hold_layers
from usdface.io.usd.sandbox import try_to_open
from usdface.io.usd_names import unusable_part
from usdface.plain_text import plain

__all__ = [
    "Stage",
    "check_clocks",
    "default_prim",
    "is_usd",
    "open_layer",
    "open_stage",
    "stage_name",
]

# For those above io who pass a stage on without looking into it.
Stage = Usd.Stage


def open_stage(path: Path, without: Collection[Path] = ()) -> Usd.Stage:
    """Open a USD file, leaving out layers at `without`, be they there or not.

    One that is not known is opened by a process of its own first (`usdface.io.usd.sandbox`).

    Raises
    ------
    InputError
        If it, or a file that it brings in, is missing or cannot be read as USD.
    """
    if path.is_dir() or (path.is_file() and not is_usd(path)):
        raise InputError(
            f"{path} is no USD file; `usdface rig` makes one of a character, `usdface take` of a "
            "recording, `usdface shot` of both",
            "FILE_KIND_UNKNOWN",
        )
    if not path.is_file():
        raise InputError(f"no such USD file: {path}", "FILE_UNREADABLE")
    finish_dead_runs(path.parent)
    try_to_open(path)
    left_out = {layer.resolve() for layer in without}
    with usd_errors(str(path)):
        stage = Usd.Stage.Open(str(path))
        _reload_changed(stage)
        hold_layers(stage)
        broken = [one_line(str(error)) for error in stage.GetCompositionErrors()]
        for layer in stage.GetUsedLayers():
            if Path(layer.realPath) in left_out:
                stage.MuteLayer(layer.identifier)
    check_clocks(stage)
    if broken and (fault := unusable_part(path)):
        raise InputError(f"{path} does not compose: {fault}", "FILE_UNREADABLE")
    for error in broken:
        if not any(f"@{layer.as_posix()}@" in error for layer in left_out):
            raise InputError(f"{path} does not compose: {_with_remedy(error)}", "SCHEMA_BROKEN")
    return stage


def _reload_changed(stage: Usd.Stage) -> None:
    """Read again the layers of a stage whose files changed since USD read them.

    USD shares a layer with whoever holds it: an error in a console holds the stage that it came
    from, and the file that was corrected would not count. Unsaved edits stay.
    """
    read: set[Sdf.Layer] = set()
    while found := set(stage.GetUsedLayers()) - read:
        Sdf.Layer.ReloadLayers(set(filter(_of_its_file, found)))
        read |= found


def _of_its_file(layer: Sdf.Layer) -> bool:
    """Return whether a layer is nothing but a file that was read: others are lost by a reload."""
    return not (layer.anonymous or layer.dirty)


def _with_remedy(error: str) -> str:
    """Return USD's words about a layer that it could not open, with a remedy where it is lost.

    As where a shot was moved without its rig and take, or a result without its layers.
    """
    text = error.removesuffix(".").removesuffix("; skipping")
    lost = text.startswith(("Could not open asset @", "Could not load sublayer @"))
    if not lost or " -- " in text:  # the file is there, and the reason given
        return text
    return f"{text}; move that file there, or make the file that names it again"


def check_clocks(stage: Usd.Stage) -> None:
    """Check the clock of every layer of a stage: USD would loop over its frames for ever.

    Raises
    ------
    InputError
        If one is not positive and finite.
    """
    for layer in stage.GetUsedLayers():
        if layer.HasTimeCodesPerSecond() or not layer.HasFramesPerSecond():
            name, clock = "timeCodesPerSecond", layer.timeCodesPerSecond
        else:  # which then stands for it
            name, clock = "framesPerSecond", layer.framesPerSecond
        if not 0 < clock < np.inf:
            where = layer.realPath or layer.identifier
            raise InputError(
                f"{where}: {name} is {clock:g}; expected a positive number", "SETTING_WRONG"
            )


def stage_name(stage: Usd.Stage) -> str:
    """Return the name of a stage in findings: that of its root layer."""
    return stage.GetRootLayer().GetDisplayName() or "the stage"


def is_usd(path: Path) -> bool:
    """Return whether USD reads files of this name."""
    suffix = plain(path.suffix, 20)  # USD takes it for an error that there is none
    return bool(suffix) and Sdf.FileFormat.FindByExtension(suffix) is not None


def open_layer(path: Path, *, reread: bool = False, within: Path | None = None) -> Sdf.Layer:
    """Open one layer, without those that it names; `reread`: as the file is now.

    `within` is a file that is composed of it, if one is known.

    Raises
    ------
    InputError
        If it cannot be read.
    """
    try_to_open(path, within)
    with usd_errors(str(path)):
        read = Sdf.Layer.OpenAsAnonymous if reread else Sdf.Layer.FindOrOpen
        layer = read(str(path))
        if layer and _of_its_file(layer):
            layer.Reload()
    if not layer:
        raise InputError(f"{path} cannot be read as USD", "FILE_UNREADABLE")
    return layer


def default_prim(stage: Usd.Stage, path: Path) -> Usd.Prim:
    """Return the stage's default prim.

    Raises
    ------
    InputError
        If it has none.
    """
    prim = stage.GetDefaultPrim()
    if not prim:
        raise InputError(
            f"{path} has no defaultPrim; set one, so that it can be referenced",
            "DEFAULT_PRIM_MISSING",
        )
    return prim
