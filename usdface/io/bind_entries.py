"""The entries of a binding file (`usdface.io.bind_file`), each read from parsed JSON.

Every function takes a value, and `where` it stands for errors; each raises `InputError` where the
value has another form than its entry.
"""

from collections.abc import Callable
from dataclasses import fields
from typing import Any, TypeVar

import numpy as np

from usdface.errors import InputError, errors_at
from usdface.options import (
    EXAGGERATION_PARTS,
    CleanOptions,
    ClosureOptions,
    HeadMode,
    MapOptions,
    SolveOptions,
)
from usdface.setup.binding import Binding
from usdface.setup.binding_origin import BindingOrigin
from usdface.setup.retarget_setup import check_curve_factor

__all__ = [
    "expecter",
    "read_binding",
    "read_curves",
    "read_exaggeration",
    "read_eyes",
    "read_head",
    "read_map",
    "read_neutral",
    "read_neutral_removed",
    "read_neutral_weights",
    "read_origin",
    "read_peaks",
    "read_solve",
    "read_switches",
]

_EYES_KEYS = frozenset(("joints", "turn"))
_NEUTRAL_KEYS = frozenset(("start", "end", "removed", "weights"))
_Options = TypeVar("_Options", MapOptions, SolveOptions)
_Switches = TypeVar("_Switches", CleanOptions, ClosureOptions)


def read_origin(value: object, where: str) -> BindingOrigin | None:
    """Read "made_with": the mesh and the take that the binding was made with."""
    if value is None:
        return None
    known = {part.name: part.type for part in fields(BindingOrigin)}
    kinds = {int: int, float: (int, float), str: str}
    good = isinstance(value, dict) and set(value) == set(known)
    if not good or not all(
        isinstance(part, kinds[known[name]]) and not isinstance(part, bool)  # type: ignore[index, arg-type]
        for name, part in value.items()  # type: ignore[attr-defined]
    ):
        raise InputError(
            f'{where}: "made_with" is {value!r}; leave it out, if the binding is not that of '
            "`usdface shot` any more",
            "SCHEMA_BROKEN",
        )
    return BindingOrigin(**value)  # type: ignore[arg-type]


def read_binding(document: dict[str, Any], key: str, where: str) -> Binding:
    """Read the places of "markers" or, as `key` says, of "unsure"."""
    expect = expecter(where)
    markers = expect(document.get(key), dict, f'"{key}" as an object')
    if key == "unsure":  # a place that was checked may have been copied instead of moved
        markers = {
            name: place for name, place in markers.items() if name not in document["markers"]
        }
    points, confidences = [], []
    for name, place in markers.items():
        vertex = place.get("point") if isinstance(place, dict) else None
        if not isinstance(vertex, int) or isinstance(vertex, bool) or not 0 <= vertex < 2**31:
            raise InputError(
                f'{where}: marker {name!r} is {place!r}; expected {{"point": vertex}}',
                "SCHEMA_BROKEN",
            )
        points.append(vertex)
        confidences.append(_confidence(place.get("confidence"), f"{where}: marker {name!r}"))
    mesh = expect(document.get("mesh", ""), str, '"mesh" as text')
    confidence = None if np.isnan(confidences).all() else np.array(confidences)
    return Binding(tuple(markers), np.array(points, dtype=np.int64), mesh, confidence)


def read_head(document: dict[str, Any], where: str) -> tuple[HeadMode, tuple[str, ...]]:
    """Return how the head is found, and the rigid markers if it is by them."""
    head = document.get("head", "solve")
    if head in ("solve", "stabilised"):
        return head, ()
    if isinstance(head, list) and head:
        expect = expecter(where)
        return "markers", tuple(str(expect(n, str, "head markers as names")) for n in head)
    raise InputError(
        f'{where}: "head" is {head!r}; expected "solve", "stabilised" or a list of rigid markers',
        "SCHEMA_BROKEN",
    )


def _confidence(value: object, where: str) -> float:
    if value is None:
        return float("nan")
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if not number or not 0 <= value <= 1:  # type: ignore[operator]
        raise InputError(
            f'{where} has the "confidence" {value!r}; expected a number from 0 to 1',
            "SETTING_WRONG",
        )
    return float(value)  # type: ignore[arg-type]


def expecter(where: str) -> Callable[[Any, type, str], Any]:
    """Return a function that refuses values of another type, naming the file."""

    def expect(value: Any, kind: type, expected: str) -> Any:
        if not isinstance(value, kind):
            raise InputError(f"{where}: expected {expected}; found {value!r}", "SCHEMA_BROKEN")
        return value

    return expect


def read_neutral(value: object, where: str) -> tuple[int, int] | None:
    """Read the neutral frames of "neutral": first and last, or None for "rig"."""
    if value == "rig":
        return None
    if isinstance(value, dict) and value.keys() <= _NEUTRAL_KEYS:
        start, end = value.get("start", 0), value.get("end", value.get("start", 0))
        if type(start) is int and type(end) is int and 0 <= start <= end < 2**31:
            return start, end
    raise InputError(
        f'{where}: "neutral" is {value!r}; expected {{"start": frame, "end": frame}} or "rig"',
        "SCHEMA_BROKEN",
    )


def read_neutral_removed(value: object, where: str) -> bool | None:
    """Read whether "neutral" is subtracted from a take of weights; None where it is not given."""
    removed = value.get("removed") if isinstance(value, dict) else None
    if removed is None or isinstance(removed, bool):
        return removed
    raise InputError(
        f'{where}: "removed" of "neutral" is {removed!r}; expected true or false', "SCHEMA_BROKEN"
    )


def read_neutral_weights(value: object, where: str) -> dict[str, float]:
    """Read the weights of "neutral", of blend shapes that its frames show."""
    weights = value.get("weights", {}) if isinstance(value, dict) else {}
    good = isinstance(weights, dict) and all(
        isinstance(weight, (int, float)) and not isinstance(weight, bool)
        for weight in weights.values()
    )
    if not good:
        raise InputError(
            f'{where}: the "weights" of "neutral" are {weights!r}; expected a number for each of '
            "some blend shapes",
            "SCHEMA_BROKEN",
        )
    return {name: float(weight) for name, weight in weights.items()}


def read_curves(value: object, where: str) -> dict[str, dict[str, float]]:
    """Read "curves": the blend shapes that each curve drives, with factors."""
    expect = expecter(where)
    curves: dict[str, dict[str, float]] = {}
    for curve, shapes in expect(value, dict, '"curves" as an object').items():
        expect(shapes, dict, f'the curve {curve!r} of "curves" as an object of blend shapes')
        for name, factor in shapes.items():
            with errors_at(where):
                check_curve_factor(curve, name, factor)
        curves[curve] = {name: float(factor) for name, factor in shapes.items()}
    return curves


def read_eyes(value: object, where: str) -> dict[str, Any]:
    """Read "eyes": the joints that turn the eyes, and the factor on the turns, as setup fields."""
    if isinstance(value, dict) and value.keys() <= _EYES_KEYS:
        joints, turn = value.get("joints", []), value.get("turn", 1.0)
        named = isinstance(joints, list) and all(isinstance(name, str) for name in joints)
        if named and isinstance(turn, (int, float)) and not isinstance(turn, bool):
            return {"eye_joints": tuple(joints), "eye_turn": float(turn)}
    raise InputError(
        f'{where}: "eyes" is {value!r}; expected {{"joints": [left, right], "turn": factor}}',
        "SCHEMA_BROKEN",
    )


def read_exaggeration(value: object, where: str) -> dict[str, float]:
    """Read "exaggeration": factors for parts of the face, or one for all."""
    parts: dict[str, Any] = value if isinstance(value, dict) else {EXAGGERATION_PARTS[0]: value}
    for factor in parts.values():
        if not isinstance(factor, (int, float)) or isinstance(factor, bool):
            raise InputError(
                f'{where}: "exaggeration" is {value!r}; expected a number, or an object with '
                f"numbers for {', '.join(EXAGGERATION_PARTS)}",
                "SCHEMA_BROKEN",
            )
    return {part: float(factor) for part, factor in parts.items()}


def read_peaks(value: object, where: str) -> tuple[int, ...]:
    """Read "peaks": frame indices of strong expressions."""
    good = isinstance(value, list) and all(
        isinstance(frame, int) and not isinstance(frame, bool) and 0 <= frame < 2**31
        for frame in value
    )
    if not good:
        raise InputError(
            f'{where}: "peaks" is {value!r}; expected a list of frame indices', "SCHEMA_BROKEN"
        )
    return tuple(value)  # type: ignore[arg-type]


def read_map(value: object, where: str) -> MapOptions:
    """Read "map"; one whose kernel, radius or smoothing is named is not chosen."""
    named = isinstance(value, dict) and not {"kernel", "radius", "smoothing"}.isdisjoint(value)
    return _options(MapOptions, {"choice": "fixed"} | value if named else value, where)  # type: ignore[operator]


def read_solve(value: object, where: str) -> SolveOptions:
    """Read "solve"; one whose agility is named does not learn how weights move."""
    named = isinstance(value, dict) and "agility" in value
    return _options(SolveOptions, {"prior": "fixed"} | value if named else value, where)  # type: ignore[operator]


def _options(kind: type[_Options], value: object, where: str) -> _Options:
    known = {field.name: field.default for field in fields(kind)}
    if not isinstance(value, dict) or set(value) - set(known):
        raise InputError(
            f"{where} is {value!r}; expected an object with {', '.join(known)}", "SCHEMA_BROKEN"
        )
    for name, setting in value.items():
        wanted = str if isinstance(known[name], str) else (int, float)
        if not isinstance(setting, wanted) or isinstance(setting, bool):
            raise InputError(
                f"{where}: {name!r} is {setting!r}; the default is {known[name]!r}", "SETTING_WRONG"
            )
    with errors_at(where):
        return kind(**value)


def read_switches(kind: type[_Switches], value: object, where: str) -> _Switches:
    """Read which steps of the clean-up or the closure are done; `true` and `false`: all, none."""
    steps = [field.name for field in fields(kind)]
    if isinstance(value, bool):
        return kind(**dict.fromkeys(steps, value))
    good = isinstance(value, dict) and set(value) <= set(steps)
    if not good or not all(isinstance(step, bool) for step in value.values()):  # type: ignore[attr-defined]
        raise InputError(
            f"{where} is {value!r}; expected true, false or an object with true or false for "
            f"{', '.join(steps)}",
            "SCHEMA_BROKEN",
        )
    return kind(**value)  # type: ignore[arg-type]
