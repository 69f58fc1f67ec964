"""Units, up axis and clock of stages and layers, and time codes by that clock."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from pxr import Sdf, Usd, UsdGeom

from usdface.arrays import FloatArray
from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.geometry.units_and_axes import to_metres
from usdface.io.usd.held_layers import hold_layers
from usdface.takes import frame_step

__all__ = [
    "Metrics",
    "codes_of",
    "metrics_of",
    "missing_metrics",
    "new_layer",
    "new_stage",
    "rate_of",
    "times_of",
    "to_si",
]

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


def new_stage(metrics: Metrics, default_prim: str = "") -> Usd.Stage:
    """Make an empty stage in memory whose root layer carries all of `metrics`."""
    stage = Usd.Stage.CreateInMemory()
    hold_layers(stage)
    _author_metrics(stage, metrics)
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


def _author_metrics(stage: Usd.Stage, metrics: Metrics) -> None:
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
    return 1.0 / frame_step(times) if len(times) > 1 else _FALLBACK_RATE
