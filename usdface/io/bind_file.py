"""The binding file, JSON: written by hand or by `usdface shot`.

::

    {"mesh": "/Asset/Face/Head",
     "markers": {"NoseHead": {"point": 3124}, "ForeHead": {"point": 877}},
     "head": "solve", "nose_tip": "NoseHead", "eyes": {"joints": ["eye.L", "eye.R"], "turn": 0.5},
     "unsure": {"Chin": {"point": 640, "confidence": 0.31}},
     "roles": {"lip_lower": "DownLip"}, "neutral": {"start": 0, "end": 30}, "peaks": [51, 204],
     "map": {"radius": 3.0}, "solve": {"smoothness": 1.0},
     "clean": {"gaps": false}, "exaggeration": {"face": 1.2, "brows": 1.5}}

Only `markers` is needed, and not for a take of weights. `curves` are of such a take: the blend
shapes that recorded curves drive, with factors, as in
{"EyeBlinkLeft": {"eye-left-closure": 1.0}}. A marker may have a "confidence" (0 to 1), as proposed
ones do; those that are "unsure" are not bound. `head` is
"solve", "stabilised" or a list of truly rigid markers; `eyes` names the joints that turn the left
and the right eye by the gaze curves of a take of weights, and a factor on the turns; `neutral` is
in frame indices of the take, or "rig" where the take's neutral is the rig's own neutral mesh, in
the same space; its "weights" are those of blend shapes that the performer shows in the neutral
frames, which the solve finds where none are given, and "removed" says whether a take of weights
counts from what it shows there, as it does where they are named; `peaks` are frame indices of
strong expressions, by which places are proposed; `map` and `solve` override `usdface.options`. A
map whose kernel, radius or smoothing is named is not chosen, unless its `choice` says "auto"; a
solve whose agility is named does not learn how weights move, unless its `prior` says "learned".
`exaggeration` has factors on the solved weights, of the face and of its regions "brows", "eyes" and
"mouth", or is one number for the face.
`made_with`, written by usdface, tells the mesh and the take: another mesh is refused, neutral and
peak frames are not carried to another take. `fingerprint` tells whether a person edited a file that
usdface wrote (`usdface.io.json_fingerprint`); it is not read.
"""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from usdface.errors import InputError
from usdface.findings import Finding
from usdface.io.bind_entries import (
    expecter,
    read_binding,
    read_curves,
    read_exaggeration,
    read_eyes,
    read_head,
    read_map,
    read_neutral,
    read_neutral_removed,
    read_neutral_weights,
    read_origin,
    read_peaks,
    read_solve,
    read_switches,
)
from usdface.io.json_fingerprint import FINGERPRINT, sign
from usdface.io.json_values import checked_object, whole_number
from usdface.options import CleanOptions, ClosureOptions
from usdface.setup.binding import Binding
from usdface.setup.retarget_setup import RetargetSetup

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
        "eyes",
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


def read_bind(path: Path) -> tuple[RetargetSetup, list[Finding]]:
    """Read a binding file.

    Returns
    -------
    RetargetSetup
        If it names no neutral frames, the first is taken as neutral (`neutral_assumed`), until
        they are detected in a take.
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
    except UnicodeDecodeError as error:
        raise InputError(
            f"the binding {path} is no text; expected JSON, as --write-bind writes it",
            "FILE_UNREADABLE",
        ) from error
    except (ValueError, RecursionError) as error:
        raise InputError(
            f"the binding {path} is no JSON that can be read: {error}", "FILE_UNREADABLE"
        ) from error
    return setup_of_json(document, str(path)), []


def setup_of_json(document: object, where: str) -> RetargetSetup:
    """Make a setup of a parsed binding file; `where` names it in errors."""
    expect = expecter(where)
    expect(document, dict, "an object")
    assert isinstance(document, dict)
    unknown = sorted(set(document) - _KEYS)
    if unknown:
        raise InputError(
            f"{where}: unknown key {unknown[0]!r}; known: {', '.join(sorted(_KEYS))}",
            "SCHEMA_BROKEN",
        )
    curves = read_curves(document.get("curves", {}), where)
    without: dict[str, Any] = {"markers": {}} if document else {}  # a take of weights has none
    binding = read_binding(without | document, "markers", where)
    unsure = read_binding({"unsure": {}} | without | document, "unsure", where)
    head, rigid = read_head(document, where)
    roles = expect(document.get("roles", {}), dict, '"roles" as an object')
    for role, marker in roles.items():
        expect(marker, str, f"role {role!r} as a marker name")
    return RetargetSetup(
        binding,
        head=head,
        head_markers=rigid,
        move_head=expect(document.get("move_head", True), bool, '"move_head" as true or false'),
        head_joint=expect(document.get("head_joint", ""), str, '"head_joint" as a joint\'s name'),
        **read_eyes(document.get("eyes", {}), where),
        neutral=read_neutral(document.get("neutral", {"start": 0, "end": 0}), where),
        neutral_assumed="neutral" not in document,
        neutral_removed=read_neutral_removed(document.get("neutral"), where),
        neutral_weights=read_neutral_weights(document.get("neutral"), where),
        peaks=read_peaks(document.get("peaks", []), where),
        nose_tip=expect(document.get("nose_tip", ""), str, '"nose_tip" as a marker name'),
        roles=roles,
        map=read_map(document.get("map", {}), f'{where}: "map"'),
        solve=read_solve(document.get("solve", {}), f'{where}: "solve"'),
        clean=read_switches(CleanOptions, document.get("clean", {}), f'{where}: "clean"'),
        closure=read_switches(ClosureOptions, document.get("closure", {}), f'{where}: "closure"'),
        curves=curves,
        exaggeration=read_exaggeration(document.get("exaggeration", {}), where),
        unsure=unsure,
        origin=read_origin(document.get("made_with"), where),
    )


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
    if eyes := _eyes_entry(setup):
        document["eyes"] = eyes
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


def _eyes_entry(setup: RetargetSetup) -> dict[str, Any]:
    joints = {"joints": list(setup.eye_joints)} if setup.eye_joints else {}
    return joints | ({"turn": setup.eye_turn} if setup.eye_turn != 1.0 else {})


def _neutral_entry(setup: RetargetSetup) -> object:
    if setup.neutral is None:
        return "rig"
    start, end = setup.neutral
    weights = {"weights": dict(setup.neutral_weights)} if setup.neutral_weights else {}
    removed = {} if setup.neutral_removed is None else {"removed": setup.neutral_removed}
    return {"start": start, "end": end} | removed | weights


def _places(binding: Binding) -> dict[str, Any]:
    confidences = np.full(len(binding.markers), np.nan)
    if binding.confidence is not None:
        confidences = binding.confidence
    return {
        name: {"point": int(point)}
        | ({} if np.isnan(share) else {"confidence": round(float(share), 3)})
        for name, point, share in zip(binding.markers, binding.points, confidences, strict=True)
    }
