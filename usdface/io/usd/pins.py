"""Pins on a stage: ``usdface:pin:<blend shape>`` with a sample at each pinned frame."""

from collections.abc import Iterator, Sequence

import numpy as np
from pxr import Usd

from usdface.arrays import FloatArray
from usdface.errors import did_you_mean
from usdface.findings import Finding, finding
from usdface.findings.values import Prose
from usdface.io.prim_names import prim_names
from usdface.schemas import tokens
from usdface.setup.pin import Pin

__all__ = ["read_pins"]

_Problem = tuple[str, *tuple[object, ...]]  # a template of a message, and its values
_ON_FRAME = 1e-3  # of the time between two frames


def read_pins(
    prim: Usd.Prim, names: Sequence[str], codes: FloatArray
) -> tuple[tuple[Pin, ...], list[Finding]]:
    """Read the pins of a `UsdFaceRetarget` prim.

    An attribute belongs to the blend shape of its display name, else of its name after the prefix;
    names that are not legal in USD are spelled as prim names (`usdface.io.prim_names`). A value
    without time samples applies to the whole take.

    Parameters
    ----------
    prim : Usd.Prim
    names : sequence of str
        The rig's blend shapes.
    codes : (F,) float64
        Time codes of the take's frames.

    Returns
    -------
    tuple of Pin
    list of Finding
        PIN_IGNORED for a pin of an unknown blend shape, between two frames, outside [0, 1], or by a
        spline.
    """
    legal = dict(zip(prim_names(names), names, strict=True))
    pins: dict[str, Pin] = {}
    findings: list[Finding] = []
    for attribute in prim.GetAttributes():
        is_pin = attribute.GetName().startswith(tokens.PIN_PREFIX)
        # USD 25.02 reads splines, but gives them no value.
        if not is_pin or not (attribute.HasValue() or attribute.HasSpline()):
            continue
        suffix = attribute.GetName().removeprefix(tokens.PIN_PREFIX)
        display_name = attribute.GetDisplayName()
        name = next((n for n in (display_name, suffix) if n in names), legal.get(suffix))
        where = str(attribute.GetPath())
        if name is None:
            unknown = display_name or suffix
            message = "the rig has no blend shape {shape!r}{hint}"
            hint = Prose(did_you_mean(unknown, names))
            findings.append(finding("PIN_IGNORED", where, message, unknown, hint))
        elif name in pins:
            message = "{shape!r} is pinned by another attribute too"
            findings.append(finding("PIN_IGNORED", where, message, name))
        elif not attribute.GetTimeSamples() and attribute.HasSpline():
            message = "{shape!r} is pinned by a spline; author a sample at each frame to keep"
            findings.append(finding("PIN_IGNORED", where, message, name))
        else:
            frames, weights, problems = _pinned(attribute, codes)
            findings += [finding("PIN_IGNORED", where, *problem) for problem in problems]
            if len(frames):
                pins[name] = Pin(name, np.array(frames), np.array(weights))
    return tuple(pins.values()), findings


def _pinned(
    attribute: Usd.Attribute, codes: FloatArray
) -> tuple[list[int], list[float], list[_Problem]]:
    """Return frame indices and weights of the usable samples, and the problems of the others."""
    step = float(np.min(np.diff(codes))) if len(codes) > 1 else 1.0
    found: dict[int, float] = {}
    outside: list[tuple[object, float | None]] = []
    between: list[float] = []
    for code, frame in _samples(attribute, codes):
        value = _value_at(attribute, code, step)
        if value is None:  # blocked
            continue
        if not isinstance(value, (int, float)) or not 0.0 <= value <= 1.0:
            outside.append((value, code if isinstance(code, float) else None))
        elif isinstance(code, float) and abs(codes[frame] - code) > _ON_FRAME * step:
            between.append(code)
        elif isinstance(code, float):
            found[frame] = float(value)
        else:
            found = dict.fromkeys(range(len(codes)), float(value))
    frames = sorted(found)
    return frames, [found[frame] for frame in frames], list(_problems(outside, between))


def _problems(
    outside: list[tuple[object, float | None]], between: list[float]
) -> Iterator[_Problem]:
    """Yield a template and its values for each kind of problem of an attribute.

    `outside` are wrong weights with their time codes, None where they are those of the whole take;
    `between` are time codes of no frame.
    """
    if outside:
        (value, code), *others = outside
        moment = "throughout" if code is None else f"at time code {code:g}"
        wrong = "outside 0 to 1" if isinstance(value, (int, float)) else "no number"
        weight = "{weight!r}" if isinstance(value, str) else "{weight}"  # no name of a type of USD
        message = f"the weight {weight} {moment} is {wrong}"
        if others:
            codes = [_number(other) for _, other in others if other is not None]
            yield f"{message}, as those at {{time_codes}}", value, codes
        else:
            yield message, value
    if between:
        message = f"the take has no frame at time code{'s' * (len(between) > 1)} {{time_codes}}"
        yield message, [_number(code) for code in between]


def _number(code: float) -> float:
    """Return a time code as it is written: whole ones without a point."""
    number = float(f"{code:.9g}")
    return int(number) if number.is_integer() else number


def _value_at(attribute: Usd.Attribute, code: float | Usd.TimeCode, step: float) -> object:
    """Return the value of the sample at a time code; None where it is blocked.

    Layer offsets may round the code to just before the sample, where a value or a block that ends
    there still holds. Just after it none does.
    """
    value = attribute.Get(code)
    if isinstance(code, float):
        after = attribute.Get(code + 1e-3 * _ON_FRAME * step)
        value = after if after is None or value is None else value
    return value


def _samples(
    attribute: Usd.Attribute, codes: FloatArray
) -> Iterator[tuple[float | Usd.TimeCode, int]]:
    """Yield each time code that has a sample, with the nearest frame; the default if none has."""
    samples = attribute.GetTimeSamples()
    for code in samples:
        yield float(code), int(np.abs(codes - code).argmin())
    if not samples:
        yield Usd.TimeCode.Default(), 0
