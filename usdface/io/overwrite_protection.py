"""Files that an output replaces: only those that usdface wrote as the same kind of output.

Files that a person made or edited are kept unless told otherwise. A shot, the layers of a result, a
deliverable, a binding and a calibration have a fingerprint, so that an edit shows; the others are
told by what they are. Pictures, pages and text, also that of a fuzzy system, are not looked at.
"""

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any, Literal

from usdface.errors import OutputError
from usdface.io.json_fingerprint import FINGERPRINT, is_unedited

__all__ = ["OutputKind", "check_replaced"]

OutputKind = Literal[
    "shot",
    "result",
    "layer",
    "deliverable",
    "take",
    "rig",
    "fuzzy system",
    "glTF",
    "binding",
    "calibration",
    "report",
]

_NAMES = {
    "shot": "a shot",
    "result": "a result of `process`",
    "layer": "a layer of a result",
    "deliverable": "a deliverable",
    "take": "a take",
    "rig": "a rig",
    "fuzzy system": "a fuzzy system",
    "glTF": "a glTF file",
    "binding": "a binding",
    "calibration": "a calibration",
    "report": "a report",
}
_USD = (".usda", ".usdc", ".usd")
_LARGEST = 2**28  # bytes of JSON that is looked into
# Keys of each kind of report: of most commands; of `fuzzy explain` and `neutral`; of `bench`.
_REPORTS = (
    {"written", "findings", "summary", "seconds"},
    {"frame", "time_s", "emotions", "rules"},
    {"system", "neutral", "jitter_mean", "jitter_max"},
    {"title", "promise", "within", "computed"},
    {"test_frame", "radius_px", "ways"},
)
_CALIBRATED = {"gain", "deviation", "offset", "peak"}
_IN_A_LAYER = "edits belong in a layer of your own over the result"
_EDITED = "was edited since usdface wrote it"
_CHANGED = {
    "": "",
    "edited": _EDITED,
    "unsigned": "may hold edits; an older version wrote it",
}


def check_replaced(
    outputs: Iterable[tuple[Path | None, OutputKind]],
    overwrite: bool | None = False,
    within: Path | None = None,
) -> None:
    """Refuse to replace a file of another origin or kind, or that was edited, before any work.

    Parameters
    ----------
    outputs : iterable of (Path or None, OutputKind)
        None is no output. An empty file, which holds nothing, may be replaced.
    overwrite : bool or None
        Replace them all the same; None: the command has no option ``--overwrite``.
    within : Path, optional
        A file that is composed of the layers among them.

    Raises
    ------
    OutputError
    """
    if overwrite:
        return
    places = [(place, kind) for place, kind in outputs if place is not None]
    for place, kind in [*places, *_buffers(places)]:
        if not place.is_file() or not place.stat().st_size:
            continue
        if reason := _reason(place, kind, within if kind == "layer" else None):
            way = "choose another name"
            if overwrite is not None:
                keeping = "; " + _IN_A_LAYER if kind == "layer" else ", another name keeps it"
                way = f"overwrite (--overwrite) replaces it{keeping}"
            raise OutputError(f"{place} {reason}; {way}")


def _buffers(outputs: Iterable[tuple[Path, str]]) -> list[tuple[Path, str]]:
    """Return the buffers beside outputs in .gltf, unless that of usdface is there: it has one."""
    return [
        (place.with_suffix(".bin"), "buffer")
        for place, kind in outputs
        if kind == "glTF" and place.suffix.lower() == ".gltf" and not _kind_of_gltf(place)
    ]


def _reason(place: Path, kind: str, within: Path | None) -> str:
    """Return why a file is not replaced by an output of a kind; "" if it may be."""
    if kind == "buffer":
        return "is not the buffer of a .gltf that usdface wrote"
    if kind == "glTF":
        found, changed = _kind_of_gltf(place), ""
    elif kind == "fuzzy system" and place.suffix.lower() not in _USD:
        return ""
    elif kind in ("binding", "calibration", "report"):
        if place.stat().st_size > _LARGEST:
            return "is too large to look into"
        found, changed = _kind_of_json(place)
    else:
        from usdface.io.usd.file_kind import kind_of_usd  # loads USD only here

        found, edited = kind_of_usd(place, within)
        changed = _CHANGED[edited]
    if not found:
        return f"is of another origin, not {_NAMES[kind]} that usdface wrote"
    return changed if found == kind else f"is {_NAMES[found]}, not {_NAMES[kind]}"


def _kind_of_gltf(path: Path) -> str:
    from usdface.io.gltf.external_files import generator_of

    return "glTF" if generator_of(path).startswith("usdface") else ""


def _kind_of_json(path: Path) -> tuple[str, str]:
    """Return which of the JSON files of usdface a file is, and how it was changed since."""
    try:
        document = json.loads(path.read_text(encoding="utf-8-sig"))
        for kind, (is_kind, by_hand) in _SIGNED.items():
            if is_kind(document):
                made = _EDITED if FINGERPRINT in document else f"may hold {by_hand} set by hand"
                return kind, "" if is_unedited(document) else made
    except (OSError, ValueError, RecursionError):
        return "", ""
    return ("report", "") if _is_report(document) else ("", "")


def _is_binding(document: Any) -> bool:
    return isinstance(document, dict) and isinstance(document.get("markers"), dict)


def _is_report(document: Any) -> bool:
    if document == []:  # of `fuzzy neutral`, without an emotion
        return True
    first = document[0] if isinstance(document, list) else document
    return isinstance(first, dict) and any(keys <= first.keys() for keys in _REPORTS)


def _is_calibration(document: Any) -> bool:
    shapes = document.get("shapes") if isinstance(document, dict) else None
    return (
        isinstance(shapes, dict)
        and bool(shapes)
        and all(isinstance(e, dict) and e.keys() >= _CALIBRATED for e in shapes.values())
    )


# Kinds of JSON with a fingerprint: how each is told, and a person's entries in one without.
_SIGNED = {"binding": (_is_binding, "places"), "calibration": (_is_calibration, "values")}
