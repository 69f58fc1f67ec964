"""The layout of a face, gains and exaggeration over a take, as USD attributes."""

from collections.abc import Sequence

import numpy as np
from pxr import Sdf, Usd, Vt

from usdface.arrays import FloatArray, IntArray
from usdface.correction.gains import Gains
from usdface.errors import InputError, errors_at
from usdface.face.layout import FaceLayout
from usdface.face.regions import GainRegion
from usdface.io.usd.attributes import author, value_of
from usdface.retarget.exaggeration import Exaggeration
from usdface.schemas import tokens

__all__ = ["EXAGGERATION", "read_exaggeration", "read_gains", "read_layout", "write_layout"]

_NAMES = Sdf.ValueTypeNames
_REGION_SHAPES: dict[GainRegion, str] = {
    "brows": tokens.BROWS_SHAPES,
    "eyes": tokens.EYES_SHAPES,
    "mouth": tokens.MOUTH_SHAPES,
}
_REGION_GAINS: dict[GainRegion, str] = {
    "brows": tokens.BROWS_GAIN,
    "eyes": tokens.EYES_GAIN,
    "mouth": tokens.MOUTH_GAIN,
}
EXAGGERATION: dict[str, str] = {
    "face": tokens.EXAGGERATION,
    "brows": tokens.BROWS_EXAGGERATION,
    "eyes": tokens.EYES_EXAGGERATION,
    "mouth": tokens.MOUTH_EXAGGERATION,
}


def write_layout(prim: Usd.Prim, layout: FaceLayout, meters_per_unit: float) -> None:
    """Author the layout of a face on its `UsdFaceRetarget` prim."""
    names = {tokens.LEFT_SHAPES: layout.left, tokens.RIGHT_SHAPES: layout.right}
    names |= {token: layout.regions.get(r, ()) for r, token in _REGION_SHAPES.items()}
    names[tokens.ANTAGONISTS] = tuple(name for pair in layout.antagonists for name in pair)
    for token, listed in names.items():
        author(prim, token, _NAMES.TokenArray, Vt.TokenArray(listed))
    for token, pairs in ((tokens.CONTACT_LIPS, layout.lips), (tokens.CONTACT_LIDS, layout.lids)):
        value = Vt.Vec2iArray.FromNumpy(pairs.astype(np.int32).reshape(-1, 2))
        author(prim, token, _NAMES.Int2Array, value)
    if layout.tolerance is not None:
        tolerance = layout.tolerance / meters_per_unit
        author(prim, tokens.CONTACT_TOLERANCE, _NAMES.Double, tolerance)


def read_layout(prim: Usd.Prim, meters_per_unit: float) -> FaceLayout:
    """Read the layout of a face from its `UsdFaceRetarget` prim; missing attributes are empty.

    Raises
    ------
    InputError
        If a value cannot be used; the message names the prim.
    """
    with errors_at(f"prim <{prim.GetPath()}>"):
        opposed = _names(prim, tokens.ANTAGONISTS)
        if len(opposed) % 2:
            raise InputError(f"{tokens.ANTAGONISTS} has {len(opposed)} entries; expected pairs")
        tolerance = value_of(prim, tokens.CONTACT_TOLERANCE, float)
        return FaceLayout(
            _names(prim, tokens.LEFT_SHAPES),
            _names(prim, tokens.RIGHT_SHAPES),
            {region: _names(prim, token) for region, token in _REGION_SHAPES.items()},
            tuple(zip(opposed[::2], opposed[1::2], strict=True)),
            _pairs(prim, tokens.CONTACT_LIPS),
            _pairs(prim, tokens.CONTACT_LIDS),
            None if tolerance is None else tolerance * meters_per_unit,
        )


def read_gains(
    system: Usd.Prim | None, expressions: Sequence[Usd.Prim], codes: FloatArray
) -> Gains:
    """Read the gains at the time codes of a take, interpolated between samples by USD.

    Raises
    ------
    InputError
        If a gain is not a number, or below 0; the message names the prim.
    """
    regions: dict[GainRegion, FloatArray] = {}
    overall = np.ones(1)
    if system is not None:
        overall = _curve(system, tokens.GAIN, codes)
        regions = {r: _curve(system, token, codes) for r, token in _REGION_GAINS.items()}
    emotions = {prim.GetName(): _curve(prim, tokens.GAIN, codes) for prim in expressions}
    return Gains(overall, emotions, regions)


def read_exaggeration(prim: Usd.Prim, codes: FloatArray) -> Exaggeration:
    """Read the exaggeration at the time codes of a take from its `UsdFaceRetarget` prim.

    Raises
    ------
    InputError
        If a factor is not a number, or out of its range; the message names the prim.
    """
    curves = {part: _curve(prim, token, codes) for part, token in EXAGGERATION.items()}
    with errors_at(f"prim <{prim.GetPath()}>"):
        return Exaggeration(curves)


def _curve(prim: Usd.Prim, name: str, codes: FloatArray) -> FloatArray:
    """Return an attribute over time: (F,), or (1,) where it is constant; 1 where there is none."""
    attribute = prim.GetAttribute(name)
    times = codes.tolist() if attribute and attribute.ValueMightBeTimeVarying() else [codes[0]]
    values = [attribute.Get(time) if attribute else None for time in times]
    gains = [1.0 if value is None else value for value in values]
    for value in gains:
        if not (isinstance(value, float) and np.isfinite(value) and value >= 0):
            raise InputError(
                f"prim <{prim.GetPath()}>: {name} is {value}; expected a number, 0 or more"
            )
    # A float as its shortest decimal: 0.7 is 0.7.
    return np.array([float(str(np.float32(value))) for value in gains])


def _names(prim: Usd.Prim, name: str) -> tuple[str, ...]:
    return tuple(str(entry) for entry in value_of(prim, name, Vt.TokenArray) or ())


def _pairs(prim: Usd.Prim, name: str) -> IntArray:
    value = value_of(prim, name, Vt.Vec2iArray)
    return np.zeros((0, 2), np.int64) if value is None else np.array(value, np.int64).reshape(-1, 2)
