"""The blend shapes that the curves of a take of weights drive: as mapped, or by their names."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from usdface.arrays import FloatArray
from usdface.errors import InputError, did_you_mean
from usdface.face.gaze_curves import gaze_curves_of
from usdface.face.plain_names import plain_names
from usdface.face.shape_names import DIRECTIONS, shape_key, spelling_key, whole_and_halves
from usdface.findings import Finding, finding
from usdface.findings.values import Prose
from usdface.takes import WeightsTake

__all__ = ["driving_curves", "rename_weights", "undecided", "unknown_curves"]

# The blend shapes that each curve drives, with factors, as `RetargetSetup.curves` has them.
CurveMap = Mapping[str, Mapping[str, float]]

_ROUNDED = 1e-6  # of a weight
# Recorders overshoot 0 and 1: Live Link Face by 0.003 in a range of motion. A hundredth of a shape
# is a tenth of a millimetre where it moves the skin by a centimetre. Set by hand.
_OVERSHOT = 0.01
_NAMED = 6  # names that a message lists


def rename_weights(
    take: WeightsTake, names: tuple[str, ...], curves: CurveMap | None = None
) -> tuple[WeightsTake, list[Finding]]:
    """Map a weights take to the blend shapes of another rig, by name or by a curve map.

    A column goes to the shape of the same name, else of the same name in another spelling;
    one unsided curve drives both sides, two sided curves drive an unsided shape by their
    mean; of `DIRECTIONS` neither does, nor where the rig has a movement whole and in halves, which
    would show it twice. Weights are clipped to [0, 1].

    Parameters
    ----------
    take : WeightsTake
    names : tuple of str
        The rig's blend shapes.
    curves : mapping of str to mapping of str to float, optional
        The blend shapes that a curve drives, with factors. Names decide neither for these curves
        nor for these blend shapes, which are sums.

    Returns
    -------
    WeightsTake
        Columns `names`; a blend shape without a curve is 0.
    list of Finding
        CHANNEL_IGNORED for curves without a blend shape (but those of gaze, which
        `usdface.retarget.recorded_eyes` reports), CURVE_UNKNOWN for those of `curves` that
        the take lacks. WEIGHTS_CLIPPED or WEIGHTS_OVERSHOT, but not below 0 where a factor is
        negative: such a curve takes back the motion of others.

    Raises
    ------
    InputError
        If no curve drives a blend shape, or `curves` names a curve twice, in two spellings, or a
        blend shape that the rig lacks.
    """
    mapped = _of_take(take.names, names, curves or {})
    factors = _factors(take.names, names, mapped)
    if not factors.any():
        raise InputError(_nothing_driven(take, names, curves or {}), "SHAPE_UNKNOWN")
    findings = unknown_curves(take, curves or {}, take.source)
    idle = np.flatnonzero(~np.any(factors, axis=1)).tolist()
    unused = [take.names[i] for i in idle if take.names[i] not in mapped]
    gaze = gaze_curves_of(take.names)
    unused = [name for name in unused if name not in gaze]  # it may turn joints
    if unused:
        message = "curves without a blend shape: {channels}"
        findings.append(finding("CHANNEL_IGNORED", take.source, message, unused))
    weights = take.weights @ factors
    weights = np.where((factors < 0.0).any(axis=0), weights.clip(min=0.0), weights)
    outside = np.flatnonzero(((weights < -_ROUNDED) | (weights > 1.0 + _ROUNDED)).any(axis=0))
    if len(outside):
        clipped = [names[i] for i in outside]
        most = np.abs(weights - np.clip(weights, 0.0, 1.0)).max()
        code = "WEIGHTS_CLIPPED" if most > _OVERSHOT else "WEIGHTS_OVERSHOT"
        message = "weights outside 0 to 1 were clipped, by {excess:.3g} at most: {shapes}"
        findings.append(finding(code, take.source, message, most, clipped))
    return replace(take, names=names, weights=np.clip(weights, 0.0, 1.0)), findings


def driving_curves(take: WeightsTake, names: tuple[str, ...], curves: CurveMap) -> WeightsTake:
    """Return the take with the curves alone that drive a blend shape of a rig, or its gaze.

    Whether a face rests is seen by these: others may count anything, a head's degrees say.
    Parameters are those of `rename_weights`.
    """
    factors = _factors(take.names, names, _of_take(take.names, names, curves))
    drives = np.any(factors, axis=1).tolist()
    pairs, gaze = zip(take.names, drives, strict=True), gaze_curves_of(take.names)
    return take.reordered(tuple(name for name, driving in pairs if driving or name in gaze))


def undecided(
    curves: tuple[str, ...], shapes: tuple[str, ...], curve_map: CurveMap
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the curves and the blend shapes that are neither mapped nor match by name."""
    own = _of_take(curves, shapes, curve_map)
    factors = _factors(curves, shapes, own)
    idle, still = (np.flatnonzero(~np.any(factors, axis=axis)).tolist() for axis in (1, 0))
    named = {name for each in own.values() for name in each}
    return (
        tuple(curves[i] for i in idle if curves[i] not in own),
        tuple(shapes[i] for i in still if shapes[i] not in named),
    )


def unknown_curves(take: WeightsTake, curves: CurveMap, source: str) -> list[Finding]:
    """Report the curves of a binding that the take lacks; `source` names the binding's file."""
    known = {spelling_key(name) for name in take.names}
    unknown = [curve for curve in curves if spelling_key(curve) not in known]
    if not unknown:
        return []
    hints = [did_you_mean(curve, take.names) for curve in unknown[:_NAMED]]
    hint = Prose("".join(dict.fromkeys(hints)))
    message = "the take has no curves of the names {curves}{hint}"
    return [finding("CURVE_UNKNOWN", source, message, unknown, hint)]


def _of_take(
    curves: tuple[str, ...], shapes: tuple[str, ...], curve_map: CurveMap
) -> dict[str, Mapping[str, float]]:
    """Return the entries of a curve map that the take has, by its own spelling of the curves."""
    spelt = {spelling_key(name): name for name in reversed(curves)}
    of_take, of_rig = set(curves), set(shapes)
    found: dict[str, tuple[str, Mapping[str, float]]] = {}
    for curve, driven in curve_map.items():
        unknown = next((name for name in driven if name not in of_rig), None)
        if unknown is not None:
            raise InputError(
                f"the curve {curve!r} is to drive {unknown!r}, a blend shape the rig has not"
                f"{did_you_mean(unknown, shapes)}",
                "SHAPE_UNKNOWN",
            )
        own = curve if curve in of_take else spelt.get(spelling_key(curve))
        if own in found:
            raise InputError(
                f"the curve {own!r} is named twice, as {found[own][0]!r} and {curve!r}; give it "
                "one entry",
                "NAME_REPEATED",
            )
        if own is not None:
            found[own] = curve, driven
    return {own: driven for own, (_, driven) in found.items()}


def _factors(curves: tuple[str, ...], shapes: tuple[str, ...], curve_map: CurveMap) -> FloatArray:
    """Return the factor of each curve on each blend shape: (C, S)."""
    row = {name: i for i, name in enumerate(curves)}
    column = {name: i for i, name in enumerate(shapes)}
    named = {name for driven in curve_map.values() for name in driven}
    factors = np.zeros((len(curves), len(shapes)))
    idle = [i for i, name in enumerate(curves) if name not in curve_map]
    by_name = _by_name(curves, idle, [name for name in shapes if name not in named])
    for name, rows in by_name.items():
        factors[rows, column[name]] = 1.0 / len(rows)
    for curve, driven in curve_map.items():
        for name, factor in driven.items():
            factors[row[curve], column[name]] = factor
    return factors


def _by_name(
    curves: tuple[str, ...], idle: Sequence[int], shapes: Sequence[str]
) -> dict[str, list[int]]:
    """Return the `idle` ones of the curves that drive each blend shape by their names."""
    exact = {curves[i]: i for i in idle}
    # As they are spelt first: one movement may be several shapes, each with a curve of its own.
    tables = [(key_of, _by_key(curves, idle, key_of)) for key_of in (spelling_key, shape_key)]
    found: dict[str, list[int]] = {}
    plain = plain_names(shapes)
    both_halves = whole_and_halves(plain.values())
    for name in shapes:
        columns = [exact[name]] if name in exact else []
        for key_of, by_key in tables:
            base, side = key_of(plain[name])
            columns = columns or by_key.get((base, side), [])
            if shape_key(plain[name])[0] not in both_halves:
                columns = columns or by_key.get((base, "both" if side else "either"), [])
        if columns:
            found[name] = columns
    return found


def _by_key(
    curves: tuple[str, ...], idle: Sequence[int], key_of: Callable[[str], tuple[str, str]]
) -> dict[tuple[str, str], list[int]]:
    """Return the `idle` ones of the curves by their keys, and by "either" side and "both"."""
    plain = plain_names(curves)
    by_key: dict[tuple[str, str], list[int]] = {}
    for i in idle:
        base, side = key_of(plain[curves[i]])
        by_key.setdefault((base, side), []).append(i)
        if base not in DIRECTIONS:
            by_key.setdefault((base, "either" if side else "both"), []).append(i)
    return by_key


def _nothing_driven(take: WeightsTake, names: tuple[str, ...], curves: CurveMap) -> str:
    unknown = unknown_curves(take, curves, "")
    example = {"curves": {(*take.names, "a curve")[0]: {(*names, "a blend shape")[0]: 1.0}}}
    return (
        f"no curve of the take {take.source} drives a blend shape of the rig: "
        + "".join(f"{found.message}; " for found in unknown)
        + ("" if curves else "none has the name of one, in any spelling; ")
        + f"curves: {_some(take.names)}; blend shapes: {_some(names)}; `usdface shot --bind "
        f"bind.json` reads which drives which, as {json.dumps(example, ensure_ascii=False)}"
    )


def _some(names: tuple[str, ...]) -> str:
    more = ", ..." if len(names) > _NAMED else ""
    return ", ".join(names[:_NAMED]) + more if names else "none"
