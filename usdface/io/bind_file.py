"""The binding file, JSON: written by hand or by `usdface shot`.

::

    {"mesh": "/Asset/Face/Head",
     "markers": {"NoseHead": {"point": 3124}, "ForeHead": {"point": 877}},
     "head": "solve", "nose_tip": "NoseHead",
     "unsure": {"Chin": {"point": 640, "confidence": 0.31}},
     "roles": {"lip_lower": "DownLip"}, "neutral": {"start": 0, "end": 30}, "peaks": [51, 204],
     "map": {"radius": 3.0}, "solve": {"smoothness": 1.0},
     "clean": {"gaps": false}, "exaggeration": {"face": 1.2, "brows": 1.5}}

Only `markers` is needed, and not for a take of weights. `curves` are of such a take: the blend
shapes that recorded curves drive, with factors, as in
{"EyeBlinkLeft": {"eye-left-closure": 1.0}}. A marker may have a "confidence" (0 to 1), as proposed
ones do; those that are "unsure" are not bound. `head` is
"solve", "stabilised" or a list of truly rigid markers; `neutral` is in frame indices of the
take, or "rig" where the take's neutral is the rig's own neutral mesh, in the same space; its
"weights" are those of blend shapes that the performer shows in the neutral frames, which the solve
finds where none are given; `peaks` are frame indices of strong expressions, by which places are
proposed; `map` and `solve` override `usdface.options`. A map whose kernel, radius or smoothing is
named is not chosen, unless its `choice` says "auto"; a solve whose agility is named does not learn
how weights move, unless its `prior` says "learned". `exaggeration` has factors on the solved
weights, of the face and of its regions "brows", "eyes" and "mouth", or is one number for the face.
`made_with`, written by usdface, tells the mesh and the take: another mesh is refused, neutral and
peak frames are not carried to another take. `fingerprint` tells whether a person edited a file that
usdface wrote (`usdface.io.json_fingerprint`); it is not read.
"""

import json
from collections.abc import Callable
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from usdface.binding_origin import BindingOrigin
from usdface.errors import InputError
from usdface.findings import Finding
from usdface.io.json_fingerprint import FINGERPRINT, sign
from usdface.io.json_values import checked_object, whole_number
from usdface.options import (
    EXAGGERATION_PARTS,
    CleanOptions,
    ClosureOptions,
    HeadMode,
    MapOptions,
    SolveOptions,
)
from usdface.retarget_setup import Binding, RetargetSetup, check_curve_factor

__all__ = ["bind_json", "read_bind", "setup_of_json"]

_LARGEST = 16_000_000  # bytes; 100,000 markers take less
_KEYS = frozenset(
    (
        "mesh",
        "markers",
        "unsure",
        "head",
        "move_head",
        "head_joint",
        "nose_tip",
        "roles",
        "neutral",
        "peaks",
        "curves",
        "map",
        "solve",
        "clean",
        "closure",
        "exaggeration",
        "made_with",
        FINGERPRINT,
    )
)
_NEUTRAL_KEYS = frozenset(("start", "end", "weights"))
_Options = TypeVar("_Options", MapOptions, SolveOptions)
_Switches = TypeVar("_Switches", CleanOptions, ClosureOptions)


def read_bind(path: Path) -> tuple[RetargetSetup, list[Finding]]:
    """Read a binding file.

    Returns
    -------
    RetargetSetup
        If it names no neutral frames, the first is taken as neutral (`neutral_assumed`), until
        they are looked for in a take.
    list of Finding
        Empty: `usdface.face.fitted_setup.fit_setup` reports assumptions that were not resolved.

    Raises
    ------
    InputError
        If it is missing, no JSON, or not of the form above.
    """
    try:
        if path.stat().st_size > _LARGEST:
            raise InputError(
                f"{path} is larger than any binding file; expected a small JSON file", "TOO_LARGE"
            )
        text = path.read_text(encoding="utf-8-sig")
        document = json.loads(text, object_pairs_hook=checked_object, parse_int=whole_number)
    except OSError as error:
        raise InputError(
            f"cannot read the binding {path}: {error.strerror}", "FILE_UNREADABLE"
        ) from error
    except (ValueError, RecursionError) as error:
        raise InputError(
            f"the binding {path} is no JSON that can be read: {error}", "FILE_UNREADABLE"
        ) from error
    return setup_of_json(document, str(path)), []


def setup_of_json(document: object, where: str) -> RetargetSetup:
    """Make a setup of a parsed binding file; `where` names it in errors."""
    expect = _expecter(where)
    expect(document, dict, "an object")
    assert isinstance(document, dict)
    unknown = sorted(set(document) - _KEYS)
    if unknown:
        raise InputError(
            f"{where}: unknown key {unknown[0]!r}; known: {', '.join(sorted(_KEYS))}",
            "SCHEMA_BROKEN",
        )
    curves = _curves(document.get("curves", {}), where)
    without: dict[str, Any] = {"markers": {}} if document else {}  # a take of weights has none
    binding = _binding(without | document, "markers", where)
    unsure = _binding({"unsure": {}} | without | document, "unsure", where)
    head, rigid = _head(document, where)
    roles = expect(document.get("roles", {}), dict, '"roles" as an object')
    for role, marker in roles.items():
        expect(marker, str, f"role {role!r} as a marker name")
    return RetargetSetup(
        binding,
        head=head,
        head_markers=rigid,
        move_head=expect(document.get("move_head", True), bool, '"move_head" as true or false'),
        head_joint=expect(document.get("head_joint", ""), str, '"head_joint" as a joint\'s name'),
        neutral=_neutral(document.get("neutral", {"start": 0, "end": 0}), where),
        neutral_assumed="neutral" not in document,
        neutral_weights=_neutral_weights(document.get("neutral"), where),
        peaks=_peaks(document.get("peaks", []), where),
        nose_tip=expect(document.get("nose_tip", ""), str, '"nose_tip" as a marker name'),
        roles=roles,
        map=_map_options(document.get("map", {}), f'{where}: "map"'),
        solve=_solve_options(document.get("solve", {}), f'{where}: "solve"'),
        clean=_switches(CleanOptions, document.get("clean", {}), f'{where}: "clean"'),
        closure=_switches(ClosureOptions, document.get("closure", {}), f'{where}: "closure"'),
        curves=curves,
        exaggeration=_exaggeration(document.get("exaggeration", {}), where),
        unsure=unsure,
        origin=_origin(document.get("made_with"), where),
    )


def _origin(value: object, where: str) -> BindingOrigin | None:
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


def _binding(document: dict[str, Any], key: str, where: str) -> Binding:
    expect = _expecter(where)
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


def _head(document: dict[str, Any], where: str) -> tuple[HeadMode, tuple[str, ...]]:
    """Return how the head is found, and the rigid markers if it is by them."""
    head = document.get("head", "solve")
    if head in ("solve", "stabilised"):
        return head, ()
    if isinstance(head, list) and head:
        expect = _expecter(where)
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


def _expecter(where: str) -> Callable[[Any, type, str], Any]:
    def expect(value: Any, kind: type, expected: str) -> Any:
        if not isinstance(value, kind):
            raise InputError(f"{where}: expected {expected}; found {value!r}", "SCHEMA_BROKEN")
        return value

    return expect


def _neutral(value: object, where: str) -> tuple[int, int] | None:
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


def _neutral_weights(value: object, where: str) -> dict[str, float]:
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


def _curves(value: object, where: str) -> dict[str, dict[str, float]]:
    expect = _expecter(where)
    curves: dict[str, dict[str, float]] = {}
    for curve, shapes in expect(value, dict, '"curves" as an object').items():
        expect(shapes, dict, f'the curve {curve!r} of "curves" as an object of blend shapes')
        for name, factor in shapes.items():
            try:
                check_curve_factor(curve, name, factor)
            except InputError as error:
                raise InputError(f"{where}: {error}", error.code) from error
        curves[curve] = {name: float(factor) for name, factor in shapes.items()}
    return curves


def _exaggeration(value: object, where: str) -> dict[str, float]:
    parts: dict[str, Any] = value if isinstance(value, dict) else {EXAGGERATION_PARTS[0]: value}
    for factor in parts.values():
        if not isinstance(factor, (int, float)) or isinstance(factor, bool):
            raise InputError(
                f'{where}: "exaggeration" is {value!r}; expected a number, or an object with '
                f"numbers for {', '.join(EXAGGERATION_PARTS)}",
                "SCHEMA_BROKEN",
            )
    return {part: float(factor) for part, factor in parts.items()}


def _peaks(value: object, where: str) -> tuple[int, ...]:
    good = isinstance(value, list) and all(
        isinstance(frame, int) and not isinstance(frame, bool) and 0 <= frame < 2**31
        for frame in value
    )
    if not good:
        raise InputError(
            f'{where}: "peaks" is {value!r}; expected a list of frame indices', "SCHEMA_BROKEN"
        )
    return tuple(value)  # type: ignore[arg-type]


def _map_options(value: object, where: str) -> MapOptions:
    named = isinstance(value, dict) and not {"kernel", "radius", "smoothing"}.isdisjoint(value)
    return _options(MapOptions, {"choice": "fixed"} | value if named else value, where)  # type: ignore[operator]


def _solve_options(value: object, where: str) -> SolveOptions:
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
    try:
        return kind(**value)
    except InputError as error:
        raise InputError(f"{where}: {error}", error.code) from error


def _switches(kind: type[_Switches], value: object, where: str) -> _Switches:
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


def bind_json(setup: RetargetSetup) -> str:
    """Return the binding file of a setup; reading it gives the same setup."""
    binding = setup.binding
    document: dict[str, Any] = {"mesh": binding.mesh} if binding.mesh else {}
    document |= {"markers": _places(binding)}
    document |= {"unsure": _places(setup.unsure)} if setup.unsure.markers else {}
    document |= {
        "head": list(setup.head_markers) if setup.head == "markers" else setup.head,
        "move_head": setup.move_head,
        "head_joint": setup.head_joint,
        "nose_tip": setup.nose_tip,
        "roles": dict(setup.roles),
    }
    document |= {} if setup.neutral_assumed else {"neutral": _neutral_entry(setup)}
    if setup.curves:
        document["curves"] = {curve: dict(shapes) for curve, shapes in setup.curves.items()}
    document |= {
        "peaks": list(setup.peaks),
        "map": asdict(setup.map),
        "solve": asdict(setup.solve),
        "clean": asdict(setup.clean),
        "closure": asdict(setup.closure),
    }
    if setup.origin is not None:
        document["made_with"] = asdict(setup.origin)
    if setup.exaggeration:
        document["exaggeration"] = dict(setup.exaggeration)
    return json.dumps(sign(document), indent=1, ensure_ascii=False) + "\n"


def _neutral_entry(setup: RetargetSetup) -> object:
    if setup.neutral is None:
        return "rig"
    start, end = setup.neutral
    weights = {"weights": dict(setup.neutral_weights)} if setup.neutral_weights else {}
    return {"start": start, "end": end} | weights


def _places(binding: Binding) -> dict[str, Any]:
    confidences = np.full(len(binding.markers), np.nan)
    if binding.confidence is not None:
        confidences = binding.confidence
    return {
        name: {"point": int(point)}
        | ({} if np.isnan(share) else {"confidence": round(float(share), 3)})
        for name, point, share in zip(binding.markers, binding.points, confidences, strict=True)
    }
