"""The deliverable of a shot: its face animation alone, flattened, at the shot's frame rate."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from pxr import Sdf, UsdSkel, Vt

from usdface.arrays import FloatArray
from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.io.usd.fingerprint import sign
from usdface.io.usd.head_motion import HEAD_OP
from usdface.io.usd.layer_samples import write_samples, write_value
from usdface.io.usd.metrics import Metrics, metrics_of, new_layer
from usdface.io.usd.save_layers import save_layer
from usdface.io.usd.stage import Stage
from usdface.options import DeliverOptions

__all__ = ["check_delivery", "write_deliverable"]

_MOST_FRAMES = 10_000_000  # a day at 100 frames a second
_ROUNDING = 1e-6  # frames


def check_delivery(stage: Stage, path: Path, codes: FloatArray, options: DeliverOptions) -> None:
    """Refuse a range without a frame of the take, before anything is solved or written.

    Parameters and errors are those of `write_deliverable`.
    """
    metrics = metrics_of(stage)
    _frames(codes, metrics, options.rate or metrics.frames_per_second, options, path)


def write_deliverable(
    stage: Stage, animation: str, path: Path, codes: FloatArray, options: DeliverOptions
) -> list[Finding]:
    """Write the SkelAnimation of a composed result, a sample on each frame of the shot.

    Between two samples values are those that USD plays: straight lines, rotations along the
    shortest arc.

    Parameters
    ----------
    stage : Usd.Stage
        Of the result.
    animation : str
        Path of the SkelAnimation.
    path : Path
        .usdc, .usda or .usd.
    codes : (F,) float64
        Time codes of the take's frames on the stage.
    options : DeliverOptions

    Returns
    -------
    list of Finding
        RANGE_OUTSIDE, and FEATURE_DROPPED for a head that moves the SkelRoot.

    Raises
    ------
    InputError
        If no frame of the range is in the take, or the rate makes too many of it.
    OutputError
        If the file cannot be written.
    """
    source = UsdSkel.Animation.Get(stage, animation)
    query = UsdSkel.Cache().GetAnimQuery(source)
    metrics = metrics_of(stage)
    rate = options.rate or metrics.frames_per_second
    frames, cut, findings = _frames(codes, metrics, rate, options, path)
    layer = new_layer(Metrics(metrics.meters_per_unit, metrics.up_axis, rate, rate, cut[0], cut[1]))
    prim = Sdf.CreatePrimInLayer(layer, f"/{Sdf.Path(animation).name}")
    prim.specifier, prim.typeName = Sdf.SpecifierDef, "SkelAnimation"
    layer.defaultPrim = prim.name
    times = (frames * (metrics.time_codes_per_second / rate)).tolist()
    with Sdf.ChangeBlock():
        _write_weights(prim, query, frames.tolist(), times)
        _write_joints(layer, prim, query, frames.tolist(), times)
    for moved in stage.Traverse():
        if moved.HasAttribute(HEAD_OP):
            message = "the head's motion is on the SkelRoot, which is no animation: it stays behind"
            findings.append(finding("FEATURE_DROPPED", str(moved.GetPath()), message))
    sign(layer)
    save_layer(layer, path)
    return findings


def _frames(
    codes: FloatArray, metrics: Metrics, rate: float, options: DeliverOptions, path: Path
) -> tuple[FloatArray, tuple[float, float], list[Finding]]:
    """Return the frames to write, the first and last of the cut, and findings."""
    at = codes * (rate / metrics.time_codes_per_second)
    # 0 is added because a ceiling of -0 would be reported, and written, as -0
    first, last = float(np.ceil(at[0] - _ROUNDING)) + 0.0, float(np.floor(at[-1] + _ROUNDING))
    start = first if options.start is None else float(options.start)
    end = last if options.end is None else float(options.end)
    low, high = start - options.handles, end + options.handles
    outside = low < first or high > last
    low, high = max(low, first), min(high, last)
    if high - low > _MOST_FRAMES:
        raise InputError(
            f"cannot write {path}: at {rate:g} frames a second these are {high - low + 1:.3g} "
            f"frames, more than {_MOST_FRAMES}; expected a lower rate (--rate)",
            "SETTING_WRONG",
        )
    if high < low:
        raise InputError(
            f"cannot write {path}: frames {start:g} to {end:g} of {rate:g} a second are not in the "
            f"take, which has {first:g} to {last:g}",
            "FRAMES_OUTSIDE",
        )
    findings = []
    if outside and (options.start is not None or options.end is not None):
        message = (
            "frames {wanted_first:g} to {wanted_last:g} are wanted; the take has {first_code:g} to "
            "{last_code:g}, and only these are written"
        )
        wanted = start - options.handles, end + options.handles
        findings.append(finding("RANGE_OUTSIDE", str(path), message, *wanted, low, high))
    return np.arange(low, high + 1), (max(start, low), min(end, high)), findings


def _write_weights(
    prim: Sdf.PrimSpec,
    query: UsdSkel.AnimQuery,
    frames: Sequence[float],
    times: Sequence[float],
) -> None:
    names, kinds = Vt.TokenArray(list(query.GetBlendShapeOrder())), Sdf.ValueTypeNames
    write_value(prim, "blendShapes", kinds.TokenArray, names)
    weights = map(query.ComputeBlendShapeWeights, times)
    write_samples(prim, "blendShapeWeights", kinds.FloatArray, frames, weights)


def _write_joints(
    layer: Sdf.Layer,
    prim: Sdf.PrimSpec,
    query: UsdSkel.AnimQuery,
    frames: Sequence[float],
    times: Sequence[float],
) -> None:
    names, kinds = query.GetJointOrder(), Sdf.ValueTypeNames
    if not names:
        return
    write_value(prim, "joints", kinds.TokenArray, Vt.TokenArray(list(names)))
    parts = [
        Sdf.AttributeSpec(prim, name, kind)
        for name, kind in (
            ("translations", kinds.Float3Array),
            ("rotations", kinds.QuatfArray),
            ("scales", kinds.Half3Array),
        )
    ]
    moves = query.JointTransformsMightBeTimeVarying()
    for frame, time in zip(frames, times, strict=True) if moves else ((None, times[0]),):
        components = query.ComputeJointLocalTransformComponents(time)
        for part, value in zip(parts, components, strict=True):
            if frame is None:
                part.default = value
            else:
                layer.SetTimeSample(part.path, frame, value)
