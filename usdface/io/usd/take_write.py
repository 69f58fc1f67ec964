"""Takes written as USD: markers as UsdFaceMarkerTake, weights as SkelAnimation."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from pxr import Gf, Sdf, Usd, UsdSkel, Vt

from usdface.arrays import FloatArray
from usdface.io.usd.attributes import author
from usdface.io.usd.metrics import Metrics, codes_of, new_stage, rate_of, to_si
from usdface.io.usd.save_layers import save_layer
from usdface.io.usd.value_arrays import vec3f_array
from usdface.numerics.frame_blocks import frame_blocks
from usdface.plain_text import plain
from usdface.schemas import tokens, write_fallback_types
from usdface.takes import MarkerTake, WeightsTake

__all__ = ["define_take", "write_take"]

_LONGEST = 400  # characters of a source's name
# Drawn width of a marker in a viewer [m].
_MARKER_WIDTH = 0.003


def write_take(take: MarkerTake | WeightsTake, path: Path) -> None:
    """Write a take as a stage of its own: units, up axis and clock are the source's.

    A marker take becomes a `UsdFaceMarkerTake` with one sample a frame; an occluded marker
    keeps its last place and `usdface:markers:visible` says so. A weights take becomes a
    `SkelAnimation`.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    rate = take.rate or rate_of(take.times)
    codes = codes_of(take.times, rate)
    metrics = Metrics(
        take.meters_per_unit if isinstance(take, MarkerTake) else 1.0,
        take.up_axis if isinstance(take, MarkerTake) else "Y",
        rate,
        rate,
        0.0,
        float(codes[-1]),
    )
    stage = new_stage(metrics)
    stage.SetDefaultPrim(define_take(stage, "/Take", take, metrics))
    if isinstance(take, MarkerTake):
        write_fallback_types(stage.GetRootLayer())
    save_layer(stage.GetRootLayer(), path)


def define_take(
    stage: Usd.Stage,
    path: str,
    take: MarkerTake | WeightsTake,
    metrics: Metrics,
    start_code: float = 0.0,
) -> Usd.Prim:
    """Define the prim of a take; its first frame is at the time code `start_code`."""
    codes = codes_of(take.times, metrics.time_codes_per_second) + start_code
    if isinstance(take, MarkerTake):
        prim = _define_markers(stage, path, take, codes, metrics)
    else:
        prim = _define_weights(stage, path, take, codes)
    author(prim, tokens.SOURCE, Sdf.ValueTypeNames.String, plain(Path(take.source).name, _LONGEST))
    author(prim, tokens.SOURCE_RATE, Sdf.ValueTypeNames.Double, take.rate)
    author(prim, tokens.START_TIMECODE, Sdf.ValueTypeNames.String, take.start_timecode)
    return prim


def _define_markers(
    stage: Usd.Stage, path: str, take: MarkerTake, codes: FloatArray, metrics: Metrics
) -> Usd.Prim:
    prim = stage.DefinePrim(path, tokens.MARKER_TAKE)
    names = Sdf.ValueTypeNames
    author(prim, tokens.MARKERS_NAMES, names.TokenArray, Vt.TokenArray(take.names))
    author(prim, tokens.DIMENSION, names.Token, f"{take.dimension}d")
    author(prim, tokens.IMAGE_SIZE, names.Int2, Gf.Vec2i(*(take.image_size or (0, 0))))
    if take.focal_length:
        author(prim, tokens.FOCAL_LENGTH, names.Double, take.focal_length)
    if take.diameters is not None:
        diameters = take.diameters
        if take.dimension == 3:
            diameters = diameters / metrics.meters_per_unit
        author(prim, tokens.MARKERS_DIAMETERS, names.DoubleArray, diameters)
    if take.deviation:
        unit = metrics.meters_per_unit if take.dimension == 3 else 1.0
        author(prim, tokens.MARKERS_DEVIATION, names.Double, take.deviation / unit)
    if take.blink is not None:
        blink = prim.CreateAttribute(tokens.BLINK, names.Float, False)
        for code, value in zip(codes.tolist(), take.blink.tolist(), strict=True):
            blink.Set(value, code)
    if take.gaze is not None:
        gaze = prim.CreateAttribute(tokens.GAZE, names.Float2, False)
        for code, angles in zip(codes.tolist(), np.degrees(take.gaze).tolist(), strict=True):
            gaze.Set(Gf.Vec2f(*angles), code)
    if take.first_frame:
        author(prim, tokens.FIRST_FRAME, names.Int, take.first_frame)
    width = _MARKER_WIDTH / metrics.meters_per_unit
    if take.dimension == 2:
        width = max(float(np.max(np.ptp(at, axis=1))) for _, at in _native(take, metrics)) / 100.0
    points = prim.CreateAttribute(tokens.POINTS, names.Point3fArray, False)
    extent = prim.CreateAttribute("extent", names.Float3Array, False)
    prim.CreateAttribute("widths", names.FloatArray, False).Set(
        Vt.FloatArray([width] * len(take.names))
    )
    for block, native in _native(take, metrics):
        low, high = native.min(axis=1) - width / 2, native.max(axis=1) + width / 2
        for frame, code in enumerate(codes[block].tolist()):
            points.Set(vec3f_array(native[frame]), code)
            extent.Set(vec3f_array([low[frame], high[frame]]), code)
    visible = take.visible
    seen = prim.CreateAttribute(tokens.MARKERS_VISIBLE, names.BoolArray, False)
    # Held between samples, so a sample is needed only where something changes.
    changed = np.flatnonzero(np.diff(visible, axis=0).any(axis=1)) + 1
    for frame in [0, *changed.tolist()]:
        seen.Set(Vt.BoolArray(visible[frame].tolist()), codes[frame])
    return prim


def _native(take: MarkerTake, metrics: Metrics) -> Iterator[tuple[slice, FloatArray]]:
    """Yield blocks of frames and their markers (B, M, 3) in the units of a stage.

    Occluded markers have their last place, or their first one to come.
    """
    turn = np.linalg.inv(to_si(metrics)[:3, :3])
    last = _first_seen(take.positions)
    for block in frame_blocks(len(take.times)):
        own = np.concatenate([last[None], take.positions[block]])
        frames = np.arange(len(own))[:, None]
        seen = np.where(~np.isnan(own[..., 0]), frames, 0)
        filled = own[np.maximum.accumulate(seen, axis=0), np.arange(own.shape[1])][1:]
        last = filled[-1] if len(filled) else last
        native = np.zeros((*filled.shape[:2], 3))
        native[..., : take.dimension] = filled
        yield block, native @ turn if take.dimension == 3 else native


def _first_seen(positions: FloatArray) -> FloatArray:
    """Return where each marker (F, M, D) is seen first: (M, D); 0 where it never is."""
    first = np.zeros(positions.shape[1:])
    for marker in range(positions.shape[1]):
        at = np.flatnonzero(~np.isnan(positions[:, marker, 0]))[:1]
        first[marker] = positions[at, marker] if len(at) else 0.0
    return first


def _define_weights(stage: Usd.Stage, path: str, take: WeightsTake, codes: FloatArray) -> Usd.Prim:
    animation = UsdSkel.Animation.Define(stage, path)
    animation.CreateBlendShapesAttr(Vt.TokenArray(take.names))
    weights = animation.CreateBlendShapeWeightsAttr()
    for row, code in zip(take.weights.astype(np.float32), codes.tolist(), strict=True):
        weights.Set(Vt.FloatArray.FromNumpy(row), code)
    prim = animation.GetPrim()
    if take.head is not None:
        from scipy.spatial.transform import Rotation  # costs more to import than most takes need

        head = prim.CreateAttribute(tokens.HEAD_ROTATION, Sdf.ValueTypeNames.Quatf, False)
        turns = Rotation.from_rotvec(take.head.copy()).as_quat()  # x, y, z, w
        for (*axis, real), code in zip(turns.tolist(), codes.tolist(), strict=True):
            head.Set(Gf.Quatf(real, *axis), code)
    return prim
