"""Blend shapes for recorded curves of another naming convention, by their FACS action units."""

from collections.abc import Mapping, Sequence
from functools import cache
from types import MappingProxyType

from usdface.face.facs_names import FACS, NAMING_CONVENTIONS, ActionUnit
from usdface.face.plain_names import plain_names, shape_keys
from usdface.face.shape_names import shape_key, whole_and_halves

__all__ = ["curves_by_unit"]

# ARKit's jaw opens the lips, and mouthClose brings them together again: at rest a phone records as
# much of both. No action unit does that; it takes back the blend shapes that the jaw drives.
_JAW, _CLOSE = ("jawopen", ""), ("mouthclose", "")

# Eyes that turn to a side: both do, and left and right in their names are of eyes or directions.
_TURNING = (61, 62)

_Unit = tuple[str, int]  # a naming convention, and the number of one of its action units
_Key = tuple[str, str]  # a movement and its side, as `shape_key` returns them


def curves_by_unit(
    curves: Sequence[str],
    shapes: Sequence[str],
    curve_map: Mapping[str, Mapping[str, float]] = MappingProxyType({}),
) -> dict[str, dict[str, float]]:
    """Return the blend shapes of the action units that recorded curves are, with their factors.

    A blend shape is moved by the mean of its unit's curves: a smile without sides by those of both
    corners of the mouth, by a half each, unless the rig has one for each half, too. Of several
    units it is that in which it has most weight, of those that have curves: a recording has curves
    for the others, too. A curve that several units share is the one of the fewest blend shapes.
    ARKit's mouthClose, which is none, takes back as much of the jaw's.

    Parameters
    ----------
    curves : sequence of str
        As ARKit names them, or another of `usdface.face.facs_names.NAMING_CONVENTIONS`.
    shapes : sequence of str
        Of the rig, in another convention; those in the same one go by their names.
    curve_map : mapping of str to mapping of str to float
        The blend shapes that other curves drive, with factors.

    Returns
    -------
    dict of str to dict of str to float
        The factors of the blend shapes that each curve moves; without those that move none.

    Examples
    --------
    >>> curves_by_unit(("browInnerUp", "AU26"), ("eyebrows-left-inner-up", "jawOpen"))
    {'browInnerUp': {'eyebrows-left-inner-up': 1.0}, 'AU26': {'jawOpen': 1.0}}
    """
    keys = dict(zip(curves, shape_keys(curves), strict=True))
    own = {curve: unit for curve, key in keys.items() if (unit := _most_of(key))}
    found: dict[str, dict[str, float]] = {}
    twice = whole_and_halves(plain_names(shapes).values())
    for shape, (base, side) in zip(shapes, shape_keys(shapes), strict=True):
        weight, movers = 0.0, []
        for unit, share in _known().get((base, side), {}).items():
            by = [c for c in own if _carries(own[c], unit, {keys[c][1], side} - {""})]
            if base in twice:  # halves move by curves of halves, the whole by one of the whole
                by = [curve for curve in by if bool(keys[curve][1]) == bool(side)]
            if by and share > weight:
                weight, movers = share, by
        for curve in movers:
            found.setdefault(curve, {})[shape] = round(weight / len(movers), 6)
    mapped = {keys.get(curve, shape_key(curve)): by for curve, by in curve_map.items()}
    driven = mapped | {keys[curve]: by for curve, by in found.items()}
    for curve in curves:
        if keys[curve] == _CLOSE and driven.get(_JAW):
            found[curve] = {shape: -factor for shape, factor in driven[_JAW].items()}
    return {curve: found[curve] for curve in curves if curve in found}


def _carries(own: _Unit, unit: _Unit, sides: set[str]) -> bool:
    """Return whether a curve is of a blend shape's unit and side, and not of its convention.

    `sides` are those that the two have.
    """
    # The names of FACS are the same blend shape in many spellings.
    other = own[0] != unit[0] or own[0] == FACS.name
    return other and own[1] == unit[1] and (len(sides) < 2 or own[1] in _TURNING)


def _most_of(curve: _Key) -> _Unit | None:
    """Return the action unit of the fewest blend shapes that a curve is with its whole weight."""
    whole = [unit for unit, weight in _known().get(curve, {}).items() if weight == 1.0]
    sizes = {
        (c.name, n): len(weights) for c in NAMING_CONVENTIONS for n, weights in c.units.items()
    }
    return min(whole, key=lambda unit: sizes[unit], default=None)


@cache
def _known() -> dict[_Key, dict[_Unit, float]]:
    """Return the action units of all known blend shapes, by `shape_key`, with their weights."""
    known: dict[_Key, dict[_Unit, float]] = {}
    for convention in NAMING_CONVENTIONS:
        for number in convention.units:
            for name, weight in convention.names(ActionUnit(number)):
                known.setdefault(shape_key(name), {})[convention.name, number] = weight
    return known
