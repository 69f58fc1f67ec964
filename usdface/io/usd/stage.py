"""Stages and layers: opening, units and up axis, time codes, atomic writing."""

import os
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike
from pxr import Gf, Sdf, Tf, Usd, UsdGeom, UsdUtils, Vt

from usdface.arrays import FloatArray
from usdface.errors import InputError, OutputError
from usdface.findings import Finding, finding
from usdface.geometry.units_and_axes import to_metres
from usdface.io.atomic import (
    all_or_none,
    atomic_path,
    staged_files,
    when_written,
    write_bridge,
)
from usdface.io.staging import finish_dead_runs
from usdface.io.usd.errors import one_line, usd_errors, usd_message
from usdface.io.usd.held_layers import hold_layers, hold_specs
from usdface.io.usd.sandbox import try_to_open
from usdface.io.usd_names import unusable_part
from usdface.plain_text import plain

__all__ = [
    "Metrics",
    "Stage",
    "author_metrics",
    "check_clocks",
    "check_usd_name",
    "codes_of",
    "default_prim",
    "is_usd",
    "matrices",
    "metrics_of",
    "missing_metrics",
    "new_layer",
    "new_stage",
    "open_layer",
    "open_stage",
    "rate_of",
    "relative_asset",
    "save_layer",
    "save_layers",
    "times_of",
    "to_si",
    "vec2f_array",
    "vec3f_array",
]

# For those above io who pass a stage on without looking into it.
Stage = Usd.Stage

_FALLBACK_RATE = 24.0  # USD's own


@dataclass(frozen=True, slots=True)
class Metrics:
    """Units and clock of a stage.

    `time_codes_per_second` is the only clock: seconds = (time code - start) /
    time_codes_per_second. `frames_per_second` is for display.
    """

    meters_per_unit: float = 1.0
    up_axis: str = "Y"
    time_codes_per_second: float = 24.0
    frames_per_second: float = 24.0
    start: float = 0.0
    end: float = 0.0


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
    left_out = {str(layer.resolve()) for layer in without}
    with usd_errors(str(path)):
        stage = Usd.Stage.Open(str(path))
        hold_layers(stage)
        broken = [one_line(str(error)) for error in stage.GetCompositionErrors()]
        for layer in stage.GetUsedLayers():
            if layer.realPath in left_out:
                stage.MuteLayer(layer.identifier)
    check_clocks(stage)
    if broken and (fault := unusable_part(path)):
        raise InputError(f"{path} does not compose: {fault}", "FILE_UNREADABLE")
    for error in broken:
        if not any(f"@{layer}@" in error for layer in left_out):
            raise InputError(f"{path} does not compose: {_with_remedy(error)}", "SCHEMA_BROKEN")
    return stage


def _with_remedy(error: str) -> str:
    """Return USD's words about a layer that it could not open, with a remedy where it is lost.

    As where a shot was moved without its rig and take, or a result without its layers.
    """
    said = error.removesuffix(".").removesuffix("; skipping")
    lost = said.startswith(("Could not open asset @", "Could not load sublayer @"))
    if not lost or " -- " in said:  # the file is there, and the reason given
        return said
    return f"{said}; move that file there, or make the file that names it again"


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


def is_usd(path: Path) -> bool:
    """Return whether USD reads files of this name."""
    suffix = plain(path.suffix, 20)  # USD takes it for an error that there is none
    return bool(suffix) and Sdf.FileFormat.FindByExtension(suffix) is not None


def open_layer(path: Path, *, anew: bool = False, within: Path | None = None) -> Sdf.Layer:
    """Open one layer, without those that it names; `anew`: as the file is, whoever holds it.

    `within` is a file that is composed of it, if one is known.

    Raises
    ------
    InputError
        If it cannot be read.
    """
    try_to_open(path, within)
    with usd_errors(str(path)):
        read = Sdf.Layer.OpenAsAnonymous if anew else Sdf.Layer.FindOrOpen
        layer = read(str(path))
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


def new_stage(metrics: Metrics, default_prim: str = "") -> Usd.Stage:
    """Make an empty stage in memory whose root layer carries all of `metrics`."""
    stage = Usd.Stage.CreateInMemory()
    hold_layers(stage)
    author_metrics(stage, metrics)
    if default_prim:
        stage.SetDefaultPrim(UsdGeom.Xform.Define(stage, f"/{default_prim}").GetPrim())
    return stage


def new_layer(metrics: Metrics) -> Sdf.Layer:
    """Make an empty layer in memory that carries all of `metrics`."""
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.pseudoRoot.SetInfo(UsdGeom.Tokens.metersPerUnit, metrics.meters_per_unit)
    layer.pseudoRoot.SetInfo(UsdGeom.Tokens.upAxis, metrics.up_axis)
    layer.timeCodesPerSecond = metrics.time_codes_per_second
    layer.framesPerSecond = metrics.frames_per_second
    layer.startTimeCode, layer.endTimeCode = metrics.start, metrics.end
    return layer


def author_metrics(stage: Usd.Stage, metrics: Metrics) -> None:
    """Author units, up axis, clock and range on the stage's root layer."""
    UsdGeom.SetStageMetersPerUnit(stage, metrics.meters_per_unit)
    UsdGeom.SetStageUpAxis(stage, metrics.up_axis)
    stage.SetTimeCodesPerSecond(metrics.time_codes_per_second)
    stage.SetFramesPerSecond(metrics.frames_per_second)
    stage.SetStartTimeCode(metrics.start)
    stage.SetEndTimeCode(metrics.end)


def metrics_of(stage: Usd.Stage) -> Metrics:
    """Return the stage's metrics, USD's fallbacks (centimetres, Y up, 24) included.

    Raises
    ------
    InputError
        If they make no sense.
    """
    metrics = Metrics(
        UsdGeom.GetStageMetersPerUnit(stage),
        str(UsdGeom.GetStageUpAxis(stage)),
        stage.GetTimeCodesPerSecond(),
        stage.GetFramesPerSecond(),
        stage.GetStartTimeCode(),
        stage.GetEndTimeCode(),
    )
    for name, number in (
        (UsdGeom.Tokens.metersPerUnit, metrics.meters_per_unit),
        ("timeCodesPerSecond", metrics.time_codes_per_second),
    ):
        if not (np.isfinite(number) and number > 0):
            raise InputError(f"{name} is {number:g}; expected a positive number", "SETTING_WRONG")
    if metrics.up_axis not in ("Y", "Z"):
        raise InputError(f"upAxis is {metrics.up_axis!r}; expected 'Y' or 'Z'", "AXIS_UNKNOWN")
    return metrics


def missing_metrics(stage: Usd.Stage) -> list[Finding]:
    """Return metrics that the root layer lacks although a layer below authors another value.

    USD takes units and clock from the root layer alone, so a face in metres under a layer that
    lacks them becomes one of some millimetres.
    """
    root, *below = stage.GetLayerStack(includeSessionLayers=False)
    metrics = metrics_of(stage)
    found = []
    for name, code, fallback, also in (
        ("metersPerUnit", "UNITS_ASSUMED", metrics.meters_per_unit, ""),
        ("upAxis", "UP_AXIS_ASSUMED", metrics.up_axis, ""),
        # Without a clock of its own a layer has that of its frames.
        ("timeCodesPerSecond", "RATE_ASSUMED", metrics.time_codes_per_second, "framesPerSecond"),
    ):
        if any(root.pseudoRoot.HasInfo(key) for key in (name, also) if key):
            continue
        authored = [layer for layer in below if layer.pseudoRoot.HasInfo(name)]
        if authored and (value := authored[0].pseudoRoot.GetInfo(name)) != fallback:
            message = (
                "{layer} has no {name}, so that USD falls back to {fallback}; {other_layer} below "
                "it has {value}: copy it"
            )
            where, other = root.GetDisplayName(), authored[0].GetDisplayName()
            found.append(finding(code, where, message, where, name, fallback, other, value))
    return found


def to_si(metrics: Metrics) -> FloatArray:
    """Return the (4, 4) matrix from stage space to metres, Y up (row vectors, as in USD)."""
    matrix = np.eye(4)
    matrix[:3, :3] = to_metres(metrics.meters_per_unit, metrics.up_axis)
    return matrix


def times_of(codes: ArrayLike, metrics: Metrics) -> FloatArray:
    """Return time codes (F,) as seconds since the first of them."""
    values = np.asarray(codes, dtype=np.float64)
    seconds: FloatArray = (values - values[0]) / metrics.time_codes_per_second
    return seconds


def codes_of(times: ArrayLike, rate: float) -> FloatArray:
    """Return times (F,) [s] as time codes from 0; whole where they are whole but for rounding."""
    codes: FloatArray = np.asarray(times, dtype=np.float64) * rate
    whole = np.round(codes)
    return np.where(np.abs(codes - whole) < 1e-6, whole, codes)


def rate_of(times: FloatArray) -> float:
    """Return a clock [Hz] for samples at `times` (F,) [s] that have no nominal rate."""
    return float(1.0 / np.median(np.diff(times))) if len(times) > 1 else _FALLBACK_RATE


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
    relative = Path(os.path.relpath(target.resolve(), owner.resolve().parent)).as_posix()
    return relative if relative.startswith("..") else f"./{relative}"


def vec3f_array(values: ArrayLike) -> Vt.Vec3fArray:
    """Return (N, 3) numbers as a Vt.Vec3fArray."""
    return Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(values, dtype=np.float32).reshape(-1, 3))


def vec2f_array(values: ArrayLike) -> Vt.Vec2fArray:
    """Return (N, 2) numbers as a Vt.Vec2fArray."""
    return Vt.Vec2fArray.FromNumpy(np.ascontiguousarray(values, dtype=np.float32).reshape(-1, 2))


def matrices(values: ArrayLike) -> Vt.Matrix4dArray:
    """Return (N, 4, 4) row-vector matrices as a Vt.Matrix4dArray."""
    array = np.asarray(values, dtype=np.float64).reshape(-1, 4, 4)
    return Vt.Matrix4dArray([Gf.Matrix4d(*m.ravel().tolist()) for m in array])


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
