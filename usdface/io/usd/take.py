"""Takes read from USD: markers of a UsdFaceMarkerTake, weights of a SkelAnimation."""

import numpy as np
from pxr import Gf, Usd, UsdSkel

from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.errors import InputError
from usdface.io.usd.errors import usd_errors
from usdface.io.usd.metrics import Metrics, metrics_of, times_of, to_si
from usdface.io.usd.world_transforms import moves_in_world, world_transform
from usdface.numerics.frame_blocks import frame_blocks
from usdface.schemas import tokens
from usdface.takes import MarkerTake, WeightsTake, check_range

__all__ = ["count_frames", "read_take_prim"]


def read_take_prim(
    prim: Usd.Prim, frames: IntArray | None = None
) -> tuple[MarkerTake | WeightsTake, FloatArray]:
    """Read a take prim of a composed stage, or some of its frames.

    Parameters
    ----------
    prim : Usd.Prim
    frames : (F,) int64, optional
        Indices, ascending; all, if left out.

    Returns
    -------
    MarkerTake or WeightsTake
        Metres, Y up, in world space; an image's pixels as they are.
    (F,) float64
        Time codes of the frames on this stage.

    Raises
    ------
    InputError
        If the prim is not a take, has no samples, or its arrays do not fit each other.
    """
    with usd_errors(_where(prim)):
        weights = prim.IsA(UsdSkel.Animation)
        read = _read_weights(prim, frames) if weights else _read_markers(prim, frames)
        check_range(read[0])
        return read


def count_frames(prim: Usd.Prim) -> int:
    """Return how many frames a take prim has; 0 if it is none."""
    return len(_frames_of(prim).GetTimeSamples()) if prim else 0


def _frames_of(prim: Usd.Prim) -> Usd.Attribute:
    if prim.IsA(UsdSkel.Animation):
        return UsdSkel.Animation(prim).GetBlendShapeWeightsAttr()
    return prim.GetAttribute(tokens.POINTS)


def _read_markers(prim: Usd.Prim, frames: IntArray | None) -> tuple[MarkerTake, FloatArray]:
    names = prim.GetAttribute(tokens.MARKERS_NAMES).Get()
    points = prim.GetAttribute(tokens.POINTS)
    if not names or not points:
        raise InputError(
            f"{_where(prim)} is no marker take: it has no {tokens.MARKERS_NAMES}; `usdface take` "
            "makes one of a recording",
            "TAKE_KIND_WRONG",
        )
    codes, positions = _samples(points, len(names), 3, frames)
    metrics = metrics_of(prim.GetStage())
    image = prim.GetAttribute(tokens.DIMENSION).Get() == "2d"
    if image:
        positions = positions[..., :2]
    else:
        matrix = _world(prim, codes) @ to_si(metrics)
        for block in frame_blocks(len(codes)):  # in place
            own = matrix[block] if len(matrix) > 1 else matrix
            positions[block] = positions[block] @ own[:, :3, :3] + own[:, 3:, :3]
    positions[~_visibility(prim, codes, len(names))] = np.nan
    positions.setflags(write=False)  # so it is not copied
    size = prim.GetAttribute(tokens.IMAGE_SIZE).Get()
    unit = 1.0 if image else metrics.meters_per_unit
    return (
        MarkerTake(
            tuple(str(n) for n in names),
            _times(prim, codes, metrics),
            positions,
            rate=_source_rate(prim, metrics),
            meters_per_unit=metrics.meters_per_unit,
            up_axis=metrics.up_axis,
            start_timecode=str(prim.GetAttribute(tokens.START_TIMECODE).Get() or ""),
            image_size=(size[0], size[1]) if size and any(size) else None,
            source=_source(prim),
            focal_length=float(prim.GetAttribute(tokens.FOCAL_LENGTH).Get() or 0.0),
            first_frame=int(prim.GetAttribute(tokens.FIRST_FRAME).Get() or 0),
            diameters=_diameters(prim, unit),
            deviation=unit * float(prim.GetAttribute(tokens.MARKERS_DEVIATION).Get() or 0.0),
            blink=_blink(prim, codes),
            gaze=_gaze(prim, codes),
        ),
        codes,
    )


def _world(prim: Usd.Prim, codes: FloatArray) -> FloatArray:
    """Return where a prim stands in the world at time codes (F,): (F, 4, 4), or (1, 4, 4) if still.

    Programs author a still transform as one sample, too, which has no value without a time.
    """
    moments = codes if moves_in_world(prim) else codes[:1]
    return np.stack([world_transform(prim, code) for code in moments.tolist()])


def _blink(prim: Usd.Prim, codes: FloatArray) -> FloatArray | None:
    blink = prim.GetAttribute(tokens.BLINK)
    if not blink or not blink.GetNumTimeSamples():
        return None
    values = np.array([blink.Get(code) for code in codes.tolist()], dtype=np.float64)
    return np.asarray(values.clip(0.0, 1.0))


def _gaze(prim: Usd.Prim, codes: FloatArray) -> FloatArray | None:
    gaze = prim.GetAttribute(tokens.GAZE)
    if not gaze or not gaze.GetNumTimeSamples():
        return None
    values = np.array([gaze.Get(code) for code in codes.tolist()], dtype=np.float64)
    return np.radians(values)


def _diameters(prim: Usd.Prim, unit: float) -> FloatArray | None:
    diameters = prim.GetAttribute(tokens.MARKERS_DIAMETERS).Get()
    return None if not diameters else unit * np.array(diameters, dtype=np.float64)


def _times(prim: Usd.Prim, codes: FloatArray, metrics: Metrics) -> FloatArray:
    """Return time codes (F,) as seconds since the first frame of the take."""
    first = _frames_of(prim).GetTimeSamples()[0]
    return times_of([first, *codes.tolist()], metrics)[1:]


def _where(prim: Usd.Prim) -> str:
    return f"{prim.GetStage().GetRootLayer().identifier}, prim <{prim.GetPath()}>"


def _source(prim: Usd.Prim) -> str:
    return str(prim.GetAttribute(tokens.SOURCE).Get() or prim.GetPath())


def _source_rate(prim: Usd.Prim, metrics: Metrics) -> float:
    return float(prim.GetAttribute(tokens.SOURCE_RATE).Get() or metrics.time_codes_per_second)


def _samples(
    attribute: Usd.Attribute, count: int, width: int, frames: IntArray | None
) -> tuple[FloatArray, FloatArray]:
    """Read samples of an array attribute: time codes (F,) and values (F, count, width)."""
    codes = np.array(attribute.GetTimeSamples())
    if not len(codes):
        raise InputError(
            f"{_where(attribute.GetPrim())}: {attribute.GetName()} has no time samples",
            "TAKE_EMPTY",
        )
    if frames is not None:
        codes = codes[frames]
    array: FloatArray | None = None
    for frame, code in enumerate(codes.tolist()):
        value = attribute.Get(code)
        if value is None or len(value) != count:
            raise InputError(
                f"{_where(attribute.GetPrim())}: {attribute.GetName()} has "
                f"{0 if value is None else len(value)} values at time code {code:g}; "
                f"expected {count}",
                "VALUES_WRONG",
            )
        if array is None:  # no memory before a sample has shown that it is as long as expected
            array = np.empty((len(codes), count, width))
        array[frame] = np.asarray(value, dtype=np.float64).reshape(count, width)
    assert array is not None
    if not np.isfinite(array).all():
        raise InputError(
            f"{_where(attribute.GetPrim())}: {attribute.GetName()} has values that are not finite",
            "VALUES_WRONG",
        )
    return codes, array


def _visibility(prim: Usd.Prim, codes: FloatArray, count: int) -> BoolArray:
    attribute = prim.GetAttribute(tokens.MARKERS_VISIBLE)
    seen = np.ones((len(codes), count), dtype=bool)
    if not attribute or not attribute.HasAuthoredValue():
        return seen
    changes = np.array(attribute.GetTimeSamples() or [codes[0]])
    place = np.maximum(np.searchsorted(changes, codes, side="right") - 1, 0)
    needed, place = np.unique(place, return_inverse=True)
    # Between changes: at the very code of one, layer offsets may round to the value before it.
    held_at = (changes + np.append(changes[1:], changes[-1] + 1.0)) / 2.0
    values = [attribute.Get(code) for code in held_at[needed].tolist()]
    if any(value is None or len(value) != count for value in values):
        raise InputError(
            f"{_where(prim)}: {tokens.MARKERS_VISIBLE} must have {count} values", "VALUES_WRONG"
        )
    held = np.array([np.asarray(v, dtype=bool) for v in values])
    return np.asarray(held[place.ravel()])


def _read_weights(prim: Usd.Prim, frames: IntArray | None) -> tuple[WeightsTake, FloatArray]:
    animation = UsdSkel.Animation(prim)
    names = tuple(str(n) for n in animation.GetBlendShapesAttr().Get() or ())
    if not names:
        raise InputError(f"{_where(prim)} names no blendShapes", "TAKE_EMPTY")
    codes, weights = _samples(animation.GetBlendShapeWeightsAttr(), len(names), 1, frames)
    metrics = metrics_of(prim.GetStage())
    return (
        WeightsTake(
            names,
            _times(prim, codes, metrics),
            weights[..., 0],
            _source_rate(prim, metrics),
            str(prim.GetAttribute(tokens.START_TIMECODE).Get() or ""),
            _source(prim),
            _head(prim, codes),
        ),
        codes,
    )


def _head(prim: Usd.Prim, codes: FloatArray) -> FloatArray | None:
    """Return the recorded head's rotation vectors (F, 3) [rad]; None without any."""
    attribute = prim.GetAttribute(tokens.HEAD_ROTATION)
    values = [attribute.Get(code) for code in codes.tolist()] if attribute else []
    if not values or values[0] is None:
        return None
    if not all(isinstance(value, Gf.Quatf) and value.GetLength() > 0.0 for value in values):
        raise InputError(
            f"{_where(prim)}: {tokens.HEAD_ROTATION} must be quaternions of a length above 0",
            "VALUES_WRONG",
        )
    from scipy.spatial.transform import Rotation  # costs more to import than most takes need

    turns = np.array([[*value.GetImaginary(), value.GetReal()] for value in values])
    return np.asarray(Rotation.from_quat(turns).as_rotvec())
